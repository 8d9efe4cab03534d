"""A bench that is watched: read and fitted again after each mounting, with the history of the answer on the page."""

import threading
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

from nicegui import ui

from bowdenfit.addons.app.elements import address, block, button, field, markup, text, text_input
from bowdenfit.addons.app.equivalent_command import EquivalentCommand, write_command
from bowdenfit.addons.app.frame import attempt, frame, refused
from bowdenfit.addons.app.page_words import page_html, page_words
from bowdenfit.addons.app.workbench import Workbench
from bowdenfit.dataset import DESCRIPTION_FILE
from bowdenfit.errors import BowdenfitError, Faults, UsageError
from bowdenfit.kinds.descriptions import load_description
from bowdenfit.pages.page import render_section
from bowdenfit.pages.section import Picture, prose_section
from bowdenfit.questions import watch as watch_room
from bowdenfit.questions.watch.verb import VERB as WATCH
from bowdenfit.questions.watch.verb import watch
from bowdenfit.words import capitalized

_TICK = 0.5  # s between two looks at what is known; a judgement
_MOST_LINES = 2000  # of what is printed, that a page keeps; a judgement
_HEADING = "How the answer narrowed"


def request_watching(folder: Path, until: str) -> dict[str, Any]:
    """Return what `watch` is asked of a data set.

    Args:
        folder: The data set.
        until: As it is typed, see `WatchedBench`.
    """
    return {"dataset": folder, "until": until or None}


class WatchedBench:
    """One data set that is watched, in a thread of its own.

    Args:
        folder: The data set.
        until: Standard deviation to which the answer is to be known, such as "10mm"; empty for what `next` calls enough.
    """

    def __init__(self, folder: Path, until: str) -> None:
        self.until, self.printed, self.refusal, self.unreadable, self.version = until, "", "", "", 0
        self.history: Any = watch_room.History()
        self._folder, self._stopped = folder, threading.Event()
        answers = watch(**request_watching(folder, until), is_stopped=self._stopped.is_set)
        self._thread = threading.Thread(target=self._follow, args=(answers,), daemon=True)
        self._thread.start()

    @property
    def running(self) -> bool:
        """Whether it is still watched."""
        return self._thread.is_alive()

    def stop(self) -> None:
        """Watch it no longer."""
        self._stopped.set()

    def _follow(self, answers: Iterator[Any]) -> None:
        """Keep what is known, and the lines that a terminal shows of it."""
        try:
            for piece in watch_room.watch_lines(self._kept(answers), self._folder.name):
                lines = f"{self.printed}{piece}".splitlines(keepends=True)
                self.printed, self.version = "".join(lines[-_MOST_LINES:]), self.version + 1
        except BowdenfitError as error:
            self.refusal = str(error)
        self.version += 1

    def _kept(self, answers: Iterator[Any]) -> Iterator[Any]:
        """Yield answers, which the history has from then on."""
        for answer in answers:
            if isinstance(answer, watch_room.WatchedAnswer):
                self.history, self.unreadable = self.history.add(answer), ""
            else:
                self.unreadable = answer.why
            yield answer


class LivePage:
    """The page of a data set that is, or can be, watched.

    Args:
        workbench: Where it lies.
        name: Name of the data set.

    Raises:
        UsageError: There is no such data set.
    """

    def __init__(self, workbench: Workbench, name: str) -> None:
        self._workbench, self._name, self._shown, self._until = workbench, name, -1, ""
        self._folder = workbench.data_set(name)
        title = workbench.title_of(name)
        with frame("Live", ((title, address("data", name)),)):
            text("Whenever a file of this data set has a new complete row or recording, it is read and fitted again.")
            self._place = block("div")
            self._known = block("div")
            self._draw()
            ui.timer(_TICK, self._look)

    @property
    def _bench(self) -> WatchedBench | None:
        bench = self._workbench.watched.get(self._name)
        return bench if isinstance(bench, WatchedBench) else None

    def _draw(self) -> None:
        """Show what can be switched."""
        self._place.clear()
        bench = self._bench
        with self._place:
            if bench is not None and bench.running:
                with block("div", "row"):
                    state = "What was measured cannot be read." if bench.unreadable else "Watching."
                    text(state, classes=f"state {'bad' if bench.unreadable else 'good'}", role="status")
                    button("Stop watching", self._stop)
                if bench.unreadable:
                    refused(f"{bench.unreadable}\nCorrect it in the file; watching goes on.")
                return
            with field("Stop at a standard deviation of", "until", f"such as {self._example}; if empty, when enough is known"):
                text_input("until", self._until, self._state_until)
            with block("div", "row"):
                button("Watch the bench", lambda: attempt(self._start), "primary")
            folder = self._workbench.folder
            self._command = EquivalentCommand([self._written], f"In {folder}:", key="watch-command")

    @property
    def _example(self) -> str:
        """A standard deviation that this cable can be known to: of its best length, or of a coefficient."""
        with suppress(BowdenfitError):
            route = load_description(self._folder / DESCRIPTION_FILE, faults=Faults()).route
            return f"10{route.unit}" if route is not None else "0.005"
        return "0.005"

    @property
    def _written(self) -> str:
        """The command that watches as the button does."""
        request = request_watching(self._folder, self._until)
        return write_command(WATCH, request, self._workbench.folder)

    def _state_until(self, typed: str) -> None:
        self._until = typed.strip()
        self._command.show(self._written)

    def _start(self) -> None:
        if self._bench is not None and self._bench.running:
            raise UsageError(f"{self._workbench.title_of(self._name)} is watched already; stop that first.")
        self._workbench.watched[self._name] = WatchedBench(self._folder, self._until)
        self._shown = -1
        self._draw()

    def _stop(self) -> None:
        if self._bench is not None:
            self._bench.stop()

    async def _look(self) -> None:
        """Show what is known by now."""
        bench = self._bench
        if bench is None or bench.version == self._shown:
            return
        self._shown = bench.version
        self._draw()
        words = await self._workbench.compute(_render_history, bench)
        self._known.clear()
        with self._known:
            if bench.history.answers:
                _show_headline(bench.history.answers[-1])
            if bench.refusal:
                text(page_words(bench.refusal), "p", "fault", role="alert")
            markup(words, "div", id="history")
            with block("details"):
                text("Line by line", "summary")
                text(page_words(bench.printed), "pre", tabindex="0", role="log", id="printed")


def _show_headline(answer: Any) -> None:
    """Show the answer and its verdict, large enough for the other side of a bench."""
    _, _, words = watch_room.describe_answer(answer).rstrip("; ").partition("  ")
    text(page_words(words), "p", "live-answer", id="live-answer")
    if answer.trusted is not None:
        verdict = capitalized(watch_room.describe_verdict(answer).rstrip("."))
        text(f"{verdict}.", "p", f"live-verdict state {_kind(answer)}")


def _kind(answer: Any) -> str:
    """Return how the verdict is colored."""
    if answer.warning:
        return "bad"
    return "doubtful" if answer.doubts else "good"


def _render_history(bench: WatchedBench) -> str:
    """Return what is known, and its history as a chart, as HTML."""
    history = bench.history
    if not history.answers:
        return ""
    last = history.answers[-1]
    caption = watch_room.history_figure.describe_history_charts(history)
    charts = watch_room.history_figure.make_history_charts(history)
    picture = Picture("history", _HEADING, caption, charts, caption, alone=True)
    headline = last.stop or last.warning
    return page_html(render_section(prose_section(_HEADING, history.sentences(), pictures=(picture,), headline=headline), {}))
