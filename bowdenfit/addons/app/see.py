"""The page of a fit: how far it is, then what it says."""

from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nicegui import ui

from bowdenfit.addons.app.ask import ARRIVES, STOP, show_arriving, show_files, show_next
from bowdenfit.addons.app.elements import (
    address,
    block,
    button,
    choice,
    field,
    link,
    markup,
    session_root,
    text,
    text_input,
)
from bowdenfit.addons.app.equivalent_command import show_command, write_command
from bowdenfit.addons.app.fit_job import FitJob
from bowdenfit.addons.app.frame import attempt, frame, notify, refused, section
from bowdenfit.addons.app.history import read_past_fit
from bowdenfit.addons.app.page_words import page_html, page_words
from bowdenfit.addons.app.workbench import Workbench
from bowdenfit.display import Preformatted
from bowdenfit.errors import BowdenfitError
from bowdenfit.pages.page import render_section
from bowdenfit.questions import next as next_room
from bowdenfit.questions import report as report_room
from bowdenfit.questions.length.verb import VERB as LENGTH_VERB
from bowdenfit.questions.summary.verb import SUMMARY_VERB, reply, summary
from bowdenfit.results.folder import CHAIN
from bowdenfit.results.folder import FIT as FIT_FILE
from bowdenfit.verb import Reply

if TYPE_CHECKING:
    from bowdenfit.finished_fit import Fit
    from bowdenfit.results.record import Record

_TICK = 0.5  # s between two looks at a fit that runs; a judgement


class FitPage:
    """The page of a fit, drawn anew when the fit ends or goes on.

    Args:
        workbench: Where the fit is.
        name: Name of the fit.

    Raises:
        UsageError: There is no such fit.
    """

    def __init__(self, workbench: Workbench, name: str) -> None:
        self._workbench, self._name = workbench, name
        workbench.results(name)
        self._running: tuple[tuple[ui.html, ui.html, ui.html], FitJob] | None = None
        self._answered = False  # whether the answer of the fit that runs is shown
        with frame(name):
            self._place = block("div")
            with self._place:
                text("Reading ...")
            ui.timer(0.05, self.show, once=True)
            ui.timer(_TICK, self._look)  # outside of what is drawn anew, with which it would end

    async def show(self) -> None:
        """Show the fit: while it runs its stage and clock, and then its answer."""
        self._place.clear()
        self._running, job = None, self._workbench.jobs.get(self._name)
        with self._place:
            if job is not None and (job.running or (job.trusted is None and (job.refusal or job.cancelled))):
                self._show_job(job)
                if job.trusted is not None:
                    await self._show_printed()
            elif (self._workbench.results(self._name) / FIT_FILE).is_file():
                await _show_answer(self._workbench, self._name)
            else:
                self._show_interrupted()

    async def _look(self) -> None:
        """Show how far the fit is."""
        if self._running is None:
            return
        elements, job = self._running
        if not job.running or self._answered != (job.trusted is not None):
            await self.show()
            return
        stage = "" if job.progress.startswith(job.stage) else job.stage  # which says the same and more
        for element, words in zip(elements, (stage, job.progress, _clock(job.seconds)), strict=True):
            element.set_content(escape(words))

    async def _show_printed(self) -> None:
        """Show the answer of a fit whose figures are still drawn."""
        printed = await self._workbench.compute(_read_summary, self._workbench.results(self._name))
        with section("The answer", "answer"):
            _show_text(printed)

    def _show_job(self, job: FitJob) -> None:
        """Show a fit that runs, or why it ended without an answer."""
        if not job.running:
            if job.is_void:
                text("It was cancelled before sampling, and nothing of it is kept.", role="status")
                self._show_way_back(job)
                return
            if job.refusal:
                refused(job.refusal)
            elif job.cancelled:
                text("It was cancelled; what was sampled is kept.")
            self._show_interrupted()
            return
        with section("Being fitted", "running"):
            with block("div", "stage", role="status"):
                stage = text(job.stage, "span", "state")
                progress = text(job.progress, "span")
                clock = text(_clock(job.seconds), "span", "clock")
            with block("div", "row"):
                button("Cancel", lambda: self._workbench.compute(job.cancel))
            text("It goes on if this page is closed; what is sampled is kept.", classes="hint")
        self._running, self._answered = ((stage, progress, clock), job), job.trusted is not None

    def _show_way_back(self, job: FitJob) -> None:
        """Show the way to the data set of a fit of which nothing is kept."""
        names = self._workbench.data_sets()
        if name := next((name for name in names if self._workbench.data_set(name) == job.request.dataset), ""):
            with block("div", "row"):
                link(f"Back to {self._workbench.title_of(name)}", address("data", name), "button")

    def _show_interrupted(self) -> None:
        """Show how an interrupted fit goes on, or how one without draws is started again."""
        names, job = self._workbench.data_sets(), self._workbench.jobs.get(self._name)
        if not names:
            text("Its data set is no longer in this folder.")
            return
        before = next((one for one in names if job is not None and self._workbench.data_set(one) == job.request.dataset), None)
        fitting = [one for one in names if self._name.startswith(self._workbench.title_of(one))]
        likely = before or max(fitting, key=len, default=names[0])
        chosen = {"name": likely}

        async def start(resume: bool) -> None:
            def go_on() -> None:
                settings = job.request.settings if job is not None else ()
                changes: dict[str, Any] = {"resume": resume, "force": not resume, "settings": settings}
                request = self._workbench.request_fit(self._name, chosen["name"], **changes)
                self._workbench.start_fit(request)

            if await attempt(go_on):
                await self.show()

        with section("This fit has no answer yet", "interrupted"):
            with field("Data set that it is of", "data-set"):
                options = [(one, self._workbench.title_of(one)) for one in names]
                choice("data-set", likely, options, lambda one: chosen.update(name=one))
            with block("div", "row"):
                if (self._workbench.results(self._name) / CHAIN).is_file():
                    button("Resume", lambda: start(True), "primary")
                button("Start over", lambda: start(False))


def _clock(seconds: float) -> str:
    return f"{int(seconds) // 60}:{int(seconds) % 60:02}"


async def _show_answer(workbench: Workbench, name: str) -> None:
    """Show what a fit says: its summary at once, and when it is loaded all that the report says, and what can be asked."""
    folder = workbench.results(name)
    try:
        printed = await workbench.compute(_read_summary, folder)
        contents = block("div", id="contents")
        past = await workbench.compute(read_past_fit, workbench, name)
        if change := past.changes.describe():
            with block("div", "verdict doubtful", role="status"):
                text(change)
        with block("div", "columns-of-page"):
            with block("div") as left, section("The answer", "answer"):
                answer = _show_text(printed)
                loading = text("Loading the fit, for what can be asked of it ...", classes="hint", role="status")
                command = show_command(SUMMARY_VERB, {"results": folder}, workbench.folder, printed.text, key="summary-command")
                if past.data_set:  # whose description the verdict may ask to change
                    with block("div", "row"):
                        link("Look at its data", address("data", past.data_set), "button")
                        link("Describe the cable", address("describe", past.data_set), "button")
            with block("div") as right:
                pass
        below = block("div", id="everything")
        fit = await workbench.open_fit(name)
        figures = await workbench.figure_data(name)
        first, *others, pictures = await workbench.compute(_render_report, name, fit, figures, session_root())
    except BowdenfitError as error:
        refused(str(error))
        return
    answer.classes(remove="answer verdict good bad doubtful")
    answer.set_content(first)
    loading.delete()
    if fit.sampled is not None and fit.dataset.description.route is not None:
        shown = ((SUMMARY_VERB, {"results": folder}), (LENGTH_VERB, {"fit": folder}))
        command.show(*(write_command(verb, request, workbench.folder) for verb, request in shown))
    with left:
        show_arriving(workbench, fit, name)
        _show_trying(workbench, fit, name)
        show_next(workbench, fit, name)
        show_files(workbench, name)
        _show_keeping(workbench, name)
    with right, section(report_room.FIGURES_TITLE, "figures"):
        markup(pictures, "div")
    parts = [(heading, f"part-{heading.lower().replace(' ', '-')}", html) for heading, html in others]
    with contents:
        _show_contents([(heading, key) for heading, key, _ in parts])
    with below:
        for heading, key, html in parts:
            with section(heading, key):
                markup(html, "div")


def _show_trying(workbench: Workbench, fit: "Fit", name: str) -> None:
    """Show the way to trying coefficients by hand, where the data set of a fit is here as it was fitted."""
    if data_set := workbench.data_set_of(fit, name):
        with block("div", "row"):
            link("Try by hand, and its likelihood", address("try", data_set, fit=name), "button")


def _show_keeping(workbench: Workbench, name: str) -> None:
    """Show how a fit is renamed, or put into the bin."""
    new = {"name": name}

    def rename() -> None:
        workbench.rename_fit(name, new["name"])
        ui.navigate.to(address("fit", new["name"]))

    def discard() -> None:
        place = workbench.discard_fit(name)
        notify(f"{name} lies in {place.parent} now; move it back from there if you want it again.")
        ui.timer(2.0, lambda: ui.navigate.to("/"), once=True)

    with block("details"):
        text("Rename or delete this fit", "summary")
        with block("div", "row"):
            with field("Name", "new-name"):
                text_input("new-name", name, lambda typed: new.update(name=typed))
            button("Rename it", lambda: attempt(rename))
        with block("div", "row"):
            button("Delete it", lambda: attempt(discard))
            text("It is moved into fits/.deleted.", classes="hint")


def _show_contents(parts: list[tuple[str, str]]) -> None:
    """Show links to the parts of the page, as (heading, key)."""
    figures = (report_room.FIGURES_TITLE, "figures")
    first = (("The answer", "answer"), (ARRIVES, "arriving"), (STOP, "next"), ("Files", "kept-files"), figures)
    with block("nav", aria_label="On this page"), block("ul", "links"):
        for heading, key in (*first, *parts):
            with block("li"):
                link(heading, f"#{key}")


def _render_report(name: str, fit: "Record", figures: dict[str, Any], root: str) -> list[Any]:
    """Return the answer, (heading, HTML) of what else the report says but what to measure next, and the figures, as HTML."""
    drawings = {figure: f"{root}{address('kept', name, f'{figure}.png')}" for figure in figures}
    parts = report_room.report_page(fit, figures).sections
    sections = {part.title: page_html(render_section(part, drawings)) for part in parts}
    first, *others = sections
    elsewhere = {report_room.FIGURES_TITLE, next_room.TITLE}  # which have their own places on this page
    shown = [(title, sections[title]) for title in others if title not in elsewhere]
    return [sections[first], *shown, sections.get(report_room.FIGURES_TITLE, "")]


def _show_text(printed: Reply) -> Any:
    """Show a summary as it was written, and return where it is."""
    words = Preformatted(page_words(printed.text)).to_html().replace("<pre>", '<pre tabindex="0">')  # which scrolls
    return markup(words, "div", f"answer verdict {_kind_of(printed)}", id="answer-text")


def _kind_of(printed: Reply) -> str:
    """Return how the verdict is colored."""
    verdict = printed.page()["verdict"] if printed.page else {}
    if not verdict.get("trusted"):
        return "bad"
    return "doubtful" if verdict.get("doubts") or not verdict.get("usable") else "good"


def _read_summary(folder: Path) -> Reply:
    """Return what `bowdenfit summary` prints."""
    return reply(summary(folder), {})
