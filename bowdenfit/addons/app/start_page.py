"""The start page: how a data set begins, and the data sets and fits of the folder."""

from nicegui import ui
from nicegui.element import Element

from bowdenfit.addons.app.elements import BENCH, address, block, button, choice, field, link, markup, text
from bowdenfit.addons.app.frame import NAME, attempt, frame, section
from bowdenfit.addons.app.history import read_past_fit, show_past_fit
from bowdenfit.addons.app.workbench import KeptFit, Workbench
from bowdenfit.questions.start.folder import find_examples, find_verb, write_example
from bowdenfit.words import counted


def show_start(workbench: Workbench) -> None:
    """Show what lies in the folder, and what can be brought."""
    with frame(NAME):
        text(f"Friction of a Bowden cable from what was measured on its bench. Everything stays in {workbench.folder}.")
        with section("Add measurements", "bring"), block("div", "beginning"):
            with block("ul", "ways"):
                _show_ways(workbench)
            with block("figure", "bench-figure"):
                markup(BENCH, "div")
                text("What is measured: the force at both ends of the cable, and how far it is bent.", "figcaption")
        _show_data_sets(workbench)
        _show_fits(workbench)


def _show_ways(workbench: Workbench) -> None:
    """Show how a data set begins: with files or a typed table, with an example, or with a folder that has a cable.toml."""
    with block("li"):
        text("Measured files, or a table to type", "h3")
        text("Tables, workbooks and recordings as your bench wrote them; what they do not say is asked.")
        with block("div", "row"):
            button("New data set", lambda: ui.navigate.to(address("new", workbench.new_draft().key)), "primary")
    with block("li"):
        text("An example", "h3")
        _show_examples(workbench)
    with block("li"):
        text("A folder that has a cable.toml", "h3")
        text(f"Copy it into {workbench.folder}, and load this page again.")


def _show_examples(workbench: Workbench) -> None:
    """Show the examples that can be copied into the folder."""
    examples = [name for name, path in find_examples().items() if find_verb(path) == "fit"]
    if not examples:
        return
    chosen = {"name": examples[0]}

    async def take() -> None:
        if await attempt(lambda: write_example(chosen["name"], workbench.folder / chosen["name"])):
            ui.navigate.to(address("data", chosen["name"]))

    with block("div", "row"):
        with field("Copied into the folder", "example"):
            choice("example", examples[0], [(name, name) for name in examples], lambda name: chosen.update(name=name))
        button("Copy the example", take)


def _show_data_sets(workbench: Workbench) -> None:
    """Show the data sets of the folder."""
    names = workbench.data_sets()
    if unnamed := workbench.unnamed_data_sets():
        text(f"{counted(unnamed, 'data set')} cannot be opened here: rename the folder, in letters that print.", classes="hint")
    if not names:
        return
    with section("Data sets", "data-sets"), block("ul", "cards"):
        for name in names:
            with block("li"):
                text(workbench.title_of(name), "h3", dir="auto")
                with block("div", "row"):
                    link("Look at it and fit it", address("data", name), "button")


def _show_fits(workbench: Workbench) -> None:
    """Show the fits of the folder, those that run or were interrupted too."""
    fits = workbench.fits()
    running = [name for name, job in workbench.jobs.items() if job.running]
    if not (fits or running):
        return
    with section("Fits", "fits"):
        if sum(fit.finished for fit in fits) > 1:
            link("Compare two fits", "/compare")
        _show_fit_cards(workbench, fits, running)


def _show_fit_cards(workbench: Workbench, fits: list[KeptFit], running: list[str]) -> None:
    """Show a card for each fit."""
    places: dict[str, Element] = {}

    async def fill() -> None:
        for name, place in places.items():
            past = await workbench.compute(read_past_fit, workbench, name)
            with place:
                show_past_fit(past)

    ui.timer(0.05, fill, once=True)
    with block("ul", "cards"):
        for name in dict.fromkeys([*running, *(fit.name for fit in fits)]):
            finished = any(fit.name == name and fit.finished for fit in fits)
            with block("li"):
                text(name, "h3", dir="auto")
                if name in running:
                    text("Being fitted now.", classes="state doubtful")
                elif not finished:
                    text("Interrupted; it can be resumed.", classes="state doubtful")
                else:
                    places[name] = block("div")
                with block("div", "row"):
                    link("See the answer" if finished and name not in running else "Open", address("fit", name), "button")
