"""What is asked of a fit on its page: what arrives where dials stand, what to measure next, and files for other programs."""

import asyncio
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, cast

from nicegui import ui

import bowdenfit as bf
from bowdenfit.addons.app.add_rows import show_table_links
from bowdenfit.addons.app.elements import VALUE_AT_FIRST, address, block, button, choice, field, link, markup, text
from bowdenfit.addons.app.equivalent_command import EquivalentCommand, show_command, write_command
from bowdenfit.addons.app.frame import refused, section
from bowdenfit.addons.app.page_words import page_html
from bowdenfit.addons.app.workbench import Workbench
from bowdenfit.display import blocks_of, render_html
from bowdenfit.errors import BowdenfitError
from bowdenfit.pages.page import render_section
from bowdenfit.pages.section import PageSection
from bowdenfit.questions import export as export_room
from bowdenfit.questions import next as next_room
from bowdenfit.questions.export.verb import VERB as EXPORT
from bowdenfit.questions.export.verb import Target, export
from bowdenfit.questions.next.verb import VERB as NEXT
from bowdenfit.questions.predict.verb import VERB as PREDICT
from bowdenfit.questions.predict.verb import predict
from bowdenfit.questions.report.verb import VERB as REPORT_VERB
from bowdenfit.results.folder import DETAILS_TEXT, POSTERIOR, REPORT, SUMMARY
from bowdenfit.words import capitalized

if TYPE_CHECKING:
    from bowdenfit.addons.app.dials import Dial
    from bowdenfit.finished_fit import Fit

ARRIVES, STOP = "What arrives", "Measure more, or stop"  # headings
_THROTTLE = 0.1  # s between two positions of a dial that is moved; a judgement
_WAYS = (("in", "at the motor; find the load force"), ("out", "at the load; find the motor force"))
_STROKES = (("pull", "pulling"), ("return", "returning"))


class ArrivingForce:
    """The dials, and what arrives where they stand; while an answer is worked out the newest question waits.

    Args:
        workbench: Which works it out.
        fit: The fit.
        name: Name of the fit.
    """

    def __init__(self, workbench: Workbench, fit: "Fit", name: str) -> None:
        self._workbench, self._fit, self._results = workbench, fit, workbench.results(name)
        self._dials = import_module("bowdenfit.addons.app.dials")  # which loads JAX
        self._values: dict[str, float] = {}
        self._way, self._stroke = "in", "pull"
        self._asked, self._busy = 0, False

    def show(self) -> None:
        """Show the dials, and what arrives below them."""
        dials: tuple[Dial, ...] = self._dials.list_dials(self._fit)
        with block("div", "sliders"):
            for number, dial in enumerate(dials):
                self._show_dial(dial, f"dial-{number}")
        with block("div", "row"):
            with field("The force is", "dial-way"):
                choice("dial-way", self._way, _WAYS, self._choose_way)
            with field("The rope is", "dial-stroke"):
                choice("dial-stroke", self._stroke, _STROKES, self._choose_stroke)
        with block("div", role="status", aria_live="polite"):
            self._place = markup("", "div", "arrives", id="arrives")
        self._command = show_command(PREDICT, {"fit": self._results}, self._workbench.folder, key="predict-command")
        ui.timer(0.05, self._answer, once=True)

    def _show_dial(self, dial: "Dial", key: str) -> None:
        """Show a dial with its number."""
        self._values[dial.key] = dial.value
        with field(f"{dial.label} ({dial.unit})", key), block("div", "dial"):
            knob = block("input", id=key, type="range", data_key=key, min=f"{dial.low:.12g}", max=f"{dial.high:.12g}")
            knob.props["step"], knob.props[VALUE_AT_FIRST] = f"{dial.step:.12g}", f"{dial.value:.12g}"
            number = text(f"{dial.value:g}", "output", for_=key)

        async def turn(event: Any) -> None:
            self._values[dial.key] = float(event.args)
            number.set_content(f"{float(event.args):g}")
            await self._answer()

        knob.on("input", turn, throttle=_THROTTLE, js_handler="event => emit(event.target.value)")

    async def _choose_way(self, way: str) -> None:
        self._way = way
        await self._answer()

    async def _choose_stroke(self, stroke: str) -> None:
        self._stroke = stroke
        await self._answer()

    async def _answer(self) -> None:
        """Answer where the dials stand; of questions that come meanwhile the last."""
        self._asked += 1
        if self._busy:
            return
        self._busy, answered = True, 0
        try:
            while answered != self._asked:
                answered = self._asked
                request = self._dials.request_dials(self._fit, self._values, self._way == "in", self._stroke)
                try:
                    words = render_html(blocks_of(await self._workbench.compute(partial(predict, self._fit, **request))))
                except BowdenfitError as error:
                    words = render_html([str(error)])
                self._place.set_content(page_html(words))
                self._command.show(write_command(PREDICT, {"fit": self._results, **request}, self._workbench.folder))
                await asyncio.sleep(0)
        finally:
            self._busy = False


def show_arriving(workbench: Workbench, fit: "Fit", name: str) -> None:
    """Show what arrives at a length or bend, of a fit with draws."""
    with section(ARRIVES, "arriving"):
        if fit.sampled is None:
            text("This fit has no posterior, because it was made without MCMC; fit again for intervals.")
        else:
            ArrivingForce(workbench, fit, name).show()


def show_next(workbench: Workbench, fit: "Fit", name: str) -> None:
    """Show what to measure next, where it is asked for, and where it goes once it was measured.

    Args:
        workbench: Which works it out.
        fit: The fit.
        name: Name of the fit.
    """

    async def rank() -> None:
        place.clear()
        with place:
            text("Ranking what could be measured ...")
        try:
            ranking = await workbench.compute(bf.next_measurement, fit)
            words = page_html(render_section(_stop_first(next_room.ranking_section(ranking), ranking.stop), {}))
        except BowdenfitError as error:
            place.clear()
            with place:
                refused(str(error))
            return
        place.clear()
        with place:
            markup(words, "div", id="ranking")

    data_set = workbench.data_set_of(fit, name)
    with section(STOP, "next"):
        with block("div", role="status") as place:
            button("Rank what could be measured next", rank)
        show_command(NEXT, {"fit": workbench.results(name)}, workbench.folder, key="next-command")
        if data_set:
            text("Once it was measured, type it in, or let the app see the file:")
            with block("div", "row"):
                show_table_links(workbench, data_set)
                link("Live: fit again after each mounting", address("live", data_set), "button")
        else:
            text("The data set of this fit is missing or has changed; open it at the start to add what was measured.")


def _stop_first(advice: PageSection, stop: str) -> PageSection:
    """Return the advice with what it says of stopping above all, as the heading asks."""
    remaining = tuple(sentence for sentence in advice.context["sentences"] if sentence != stop)
    return replace(advice, context={**advice.context, "headline": stop, "sentences": remaining})


def show_files(workbench: Workbench, name: str) -> None:
    """Show links to the report, to the data of a fit, and to what other programs read of it."""
    folder = workbench.results(name)
    kept = (
        ("Report", REPORT), ("Everything it says", DETAILS_TEXT), (SUMMARY, SUMMARY), (f"Draws, {POSTERIOR}", POSTERIOR),
    )  # fmt: skip
    with section("Files", "kept-files"):
        _show_links([(words, address("kept", name, file)) for words, file in kept])
        text("For other programs:")
        formats = export_room.load_formats().items()
        _show_links([(capitalized(of.words), address("export", name, target)) for target, of in formats])
        commands = [write_command(EXPORT, {"fit": folder, "to": target}, workbench.folder) for target, _ in formats]
        EquivalentCommand([write_command(REPORT_VERB, {"fit": folder}, workbench.folder), *commands], f"In {workbench.folder}:")


def _show_links(links: Sequence[tuple[str, str]]) -> None:
    """Show links, as (words, address), in a row."""
    with block("ul", "links"):
        for words, target in links:
            with block("li"):
                link(words, target, target_="_blank")


def export_file(fit: "Fit", target: str) -> tuple[str, bytes]:
    """Return name and contents of the file that `bowdenfit export` writes.

    Args:
        fit: The fit.
        target: The format.

    Raises:
        UsageError: There is no such format, or it cannot express the cable.
    """
    with TemporaryDirectory() as folder:
        name = f"cable{_find_ending(fit, target)}"
        export(fit, cast("Target", target), output=Path(folder) / name)
        return name, (Path(folder) / name).read_bytes()


def _find_ending(fit: "Fit", target: str) -> str:
    """Return the ending of an exported file; empty for a format that there is none of."""
    export_format = export_room.load_formats().get(target)
    if export_format is None:
        return ""
    return (not fit.model.cable.is_loop and export_format.callback_ending) or export_format.ending
