"""The page on which measurements are brought: files on their way to a data set, what they say, and what is asked."""

import shlex
from collections.abc import Awaitable, Callable
from functools import partial
from typing import TypeAlias

from nicegui import ui

from bowdenfit.addons.app.curve_menu import is_of_curves, show_curve_menu
from bowdenfit.addons.app.data_charts import sketch_file
from bowdenfit.addons.app.description_edit import Part
from bowdenfit.addons.app.draft import Draft, Refusal, Understanding
from bowdenfit.addons.app.elements import (
    BENCH,
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
from bowdenfit.addons.app.equivalent_command import EquivalentCommand
from bowdenfit.addons.app.frame import attempt, frame, notify, refused, section
from bowdenfit.addons.app.measured_view import MeasuredView, Warnings, show_checked, sort_warnings
from bowdenfit.addons.app.page_words import page_words
from bowdenfit.addons.app.refused_recordings import sketch_refused
from bowdenfit.addons.app.sheet import FILE as TYPED
from bowdenfit.addons.app.sheet import TypedSheet
from bowdenfit.addons.app.workbench import Workbench, refuse_folder_name, refuse_module_name
from bowdenfit.dataset import DESCRIPTION_FILE
from bowdenfit.files import FORMATS
from bowdenfit.kinds.lone_file import FileColumn
from bowdenfit.pages.page import render_section
from bowdenfit.pages.section import Picture, prose_section
from bowdenfit.questions.start.measured_file import MeasuredFile
from bowdenfit.units import usual_units
from bowdenfit.words import counted, listed, shown

_BENCH_WORDS = (
    "A run is one mounting of the cable: removing and remounting it starts a new run. The stroke is pull while the motor "
    "pulls, and return while the load pulls back."
)
Again: TypeAlias = Callable[[], Awaitable[None]]
_DIMENSIONS = ("force", "angle", "length", "ratio", "velocity", "torque", "time")  # of units that a column may have
_HEADS = ("column", "unit", "read as", "first", "last", "lowest", "highest")


async def show_draft(workbench: Workbench, draft: Draft) -> None:
    """Show files on their way to a data set: what they say, and what is asked."""
    with frame("New data set"):
        with section("Files", "files"):
            zone = block("div")
        place = block("div")

    newest = {"look": 0}

    async def look_again() -> None:
        newest["look"] = look = newest["look"] + 1
        if draft.files and not (draft.is_arriving or draft.understanding.files):
            place.clear()
            with place:
                text("Reading the files ...", role="status")
        understanding = Understanding() if draft.is_arriving else await workbench.compute(draft.understand)
        sketches = await workbench.compute(_sketch_refused, draft, understanding)
        if look != newest["look"]:  # something was answered since, and is looked at next
            return
        place.clear()
        with place:
            if draft.is_arriving:
                text("Files are on their way.")
                return
            await _show_understanding(workbench, draft, understanding, sketches, look_again)
        sheet.mark(understanding.refusals)

    draft.is_arriving = False  # a page that was closed while it sent files never says that they all arrived
    sheet = TypedSheet(draft, look_again)
    with zone:
        _show_drop_zone(draft, look_again)
        with block("details") as typing:
            text("Or type or paste a table", "summary")
            sheet.show()
        if any(path.name == TYPED for path in draft.files):
            typing.props["open"] = True
    ui.timer(0.05, look_again, once=True)


def _show_drop_zone(draft: Draft, look_again: Again) -> None:
    """Show where files are dropped or chosen."""
    target = f"{session_root()}{address('upload', draft.key)}"

    async def taken(event: object) -> None:
        draft.is_arriving = False
        for sentence in getattr(event, "args", ()) or ():
            notify(str(sentence))
        await look_again()

    with block("label", "drop") as zone:
        text(
            "Drop the files that you measured here, or choose them: tables, recordings, workbooks. With a cable.toml among "
            "them they become a data set as it says.", "span",
        )  # fmt: skip
        endings = ",".join([*FORMATS, ".toml"])
        chooser = block("input", type="file", multiple="", accept=endings, aria_label="Measured files", data_key="files")
    chooser.on("change", taken, js_handler=f"async event => emit(await sendFiles(event.target.files, '{target}'))")
    zone.on("drop", taken, js_handler=f"async event => emit(await sendFiles(event.dataTransfer.files, '{target}'))")


def _sketch_refused(draft: Draft, understanding: Understanding) -> tuple[Picture, ...]:
    """Return charts of recordings that are refused before there is a cable.toml, with which `MeasuredView` draws them."""
    tables = {file.path for file in understanding.files if file.kind and not file.kind.takes_channels}
    paths = [path for path in draft.files if path not in tables]
    return () if understanding.description else sketch_refused(paths, understanding.refusals)


async def _show_understanding(
    workbench: Workbench, draft: Draft, understanding: Understanding, sketches: tuple[Picture, ...], look_again: Again
) -> None:
    """Show what is understood of a draft in steps: what was read, what is asked, and what it means."""
    if not (draft.files or draft.is_described):
        text("Nothing is here yet.")
        return
    _show_steps(understanding)
    with section("What was read", "read"):
        _show_refusals(understanding.refusals)
        place = block("div")  # of what is refused, next to the reason
        if sketches:
            markup(render_section(prose_section("", (), pictures=sketches), {}), "div")
        _show_files(draft, understanding, look_again)
    _show_questions(workbench, draft, understanding, look_again)
    warnings: Warnings = {}
    if understanding.checked is not None:
        warnings = sort_warnings(understanding.checked)
        with section("What it means", "understood"):
            show_checked(understanding.checked, warnings)
            place = block("div")
            with block("details"):
                text("The cable.toml that is written", "summary")
                text(understanding.description, "pre", "toml", tabindex="0")
        _show_writing(workbench, draft)

    async def change_part(kind: str, file: str, part: Part, reason: str | None) -> None:
        await workbench.compute(draft.change_part, kind, file, part, reason)
        await look_again()

    if understanding.description:
        with place:
            await MeasuredView(workbench, draft.folder, change_part).show(understanding.refusals, warnings)


def _show_steps(understanding: Understanding) -> None:
    """Show how far it is, with links to each step."""
    unanswered = sum(not entry.answer or bool(entry.fault) for entry in understanding.entries)
    warnings = len(understanding.checked.warnings) if understanding.checked is not None else 0
    faults = len(understanding.refusals)
    steps = [("read", "What was read", "cannot be used yet" if faults else "done", "bad" if faults else "good")]
    if understanding.entries:
        words = f"{counted(unanswered, 'answer')} missing" if unanswered else "answered; look at what is proposed"
        steps.append(("questions", "What is asked", words, "bad" if unanswered else "good"))
    if understanding.checked is not None:
        steps.append(("understood", "What it means", counted(warnings, "warning") if warnings else "nothing is wrong",
                      "doubtful" if warnings else "good"))  # fmt: skip
        steps.append(("keep", "Keep it", "", "good"))
    with block("nav", aria_label="Steps"), block("ol", "steps"):
        for key, words, state, kind in steps:
            with block("li"):
                link(words, f"#{key}")
                if state:
                    text(state, "span", f"state {kind}")


def _show_files(draft: Draft, understanding: Understanding, look_again: Again) -> None:
    """Show the files of a draft: what each holds at once, its columns when it is opened."""
    if draft.is_described:
        with block("div", "row"):
            text(DESCRIPTION_FILE, "h3")
            _remove_button(draft, DESCRIPTION_FILE, look_again)
    faults = " ".join(refusal.sentence for refusal in understanding.refusals)
    for number, file in enumerate(understanding.files):
        with block("details") as part:
            holds = f": {file.holds}" if file.holds else ""
            text(f"{file.name}{holds}", "summary", dir="auto")
            with block("div", "one-file"):
                _show_file(draft, file, look_again)
                if not understanding.description and (sketch := sketch_file(file, number)) is not None:
                    markup(render_section(prose_section("", (), pictures=(sketch,)), {}), "div")
        if len(understanding.files) == 1 or file.name in faults:
            part.props["open"] = True
    names = {file.path.name for file in understanding.files}
    for path in [path for path in draft.files if path.name not in names]:
        with block("div", "row"):
            text(path.relative_to(draft.folder).as_posix(), "h3", dir="auto")
            _remove_button(draft, path.name, look_again)
    if understanding.left_out:
        left_out = listed([shown(name) for name in understanding.left_out])
        text(f"Left out, because the contents are not what the extension says: {left_out}.", classes="hint")


def _remove_button(draft: Draft, name: str, look_again: Again) -> None:
    """Show the button that leaves a file out."""

    async def remove() -> None:
        draft.remove_file(name)
        await look_again()

    button("Leave this file out", remove, key=f"remove-{name}", aria_label=f"Leave {name} out")


def _show_file(draft: Draft, file: MeasuredFile, look_again: Again) -> None:
    """Show the columns of a file, whose meanings and units can be changed."""
    with block("div"):
        with block("div", "row"):
            _remove_button(draft, file.path.name, look_again)
        with block("div", "wide", role="region", tabindex="0", aria_label=f"Columns of {file.name}"), block("table", "columns"):
            with block("thead"), block("tr"):
                for head in _HEADS:
                    text(head, "th", "left" if head in _HEADS[:3] else "", scope="col")
            with block("tbody"):
                for number, column in enumerate(file.columns):
                    _show_column(draft, file, column, number, look_again)


def _show_column(draft: Draft, file: MeasuredFile, column: FileColumn, number: int, look_again: Again) -> None:
    """Show a column with the menus of its meaning and unit."""

    async def state(quantity: str | None = None, unit: str | None = None) -> None:
        draft.state(file.name, column.name, quantity, unit)
        await look_again()

    meanings = [("", "not used"), *((name, f"{name}: {words}" if words else name) for name, words in file.meanings.items())]
    usual = [unit for name in (column.dimension, *_DIMENSIONS) if name for unit in usual_units(name)]
    plain = column.unit.removeprefix("-")
    units = [("", "not stated"), *((unit, unit) for unit in dict.fromkeys([plain, *usual]) if unit)]
    if file.kind and file.kind.takes_channels and plain:
        units.append((f"-{plain}", f"-{plain}: the other sign"))
    key, meaning = f"{file.name}-{number}", file.meaning_of(column)
    ends = (f"{column.low:.5g}", f"{column.high:.5g}") if column.numbers else ("", "")
    with block("tr"):
        text(column.name, "th", scope="row", dir="auto")
        with block("td", "left"):
            choice(f"{key}-unit", column.unit, units, lambda unit: state(unit=unit), f"Unit of {column.name}")
        with block("td", "left"):
            choice(f"{key}-as", meaning, meanings, lambda name: state(quantity=name), f"Meaning of {column.name}")
        for value in (column.first, column.last, *ends):
            text(value, "td")


def _show_refusals(refusals: tuple[Refusal, ...]) -> None:
    """Show why a draft cannot be fitted yet, beside the cells that the refusals speak of."""
    if others := [refusal.sentence for refusal in refusals if not refusal.cells]:
        refused("\n".join(others))
    for file in dict.fromkeys(refusal.file for refusal in refusals if refusal.cells):
        _show_refused_rows(file, [refusal for refusal in refusals if refusal.cells and refusal.file == file])


def _show_refused_rows(file: str, refusals: list[Refusal]) -> None:
    """Show rows of a file with cells that cannot be read, and why."""
    with block("div", "verdict bad", role="alert"):
        text(f"{file}: cells that cannot be read.")
        with block("div", "wide", role="region", tabindex="0", aria_label=f"Cells of {file}"), block("table", "cells"):
            with block("thead"), block("tr"):
                for head in ("row", *(heading for heading, _ in refusals[0].cells)):
                    text(head, "th", scope="col")
            with block("tbody"):
                for refusal in refusals:
                    with block("tr"):
                        text(str(refusal.row), "th", scope="row")
                        for heading, cell in refusal.cells:
                            text(cell or "blank", "td", "wrong" if heading == refusal.column else "")
                    with block("tr"), block("td", "left", colspan=str(len(refusal.cells) + 1)):
                        text(page_words(refusal.sentence), "p", "fault")


def _show_questions(workbench: Workbench, draft: Draft, understanding: Understanding, look_again: Again) -> None:
    """Show what the files do not say."""
    if not understanding.entries:
        return

    async def answer(key: str, typed: str) -> None:
        draft.answers[key] = typed
        await look_again()

    with section("What the files do not state", "questions"), block("div", "questions"):
        with block("figure", "bench-figure"):
            markup(BENCH, "div")
            text(_BENCH_WORDS, "figcaption")
        for number, entry in enumerate(understanding.entries):
            key = f"question-{number}"
            hint = "" if entry.key in draft.answers and not entry.fault else entry.hint
            has_pictures = is_of_curves([option for option, _ in entry.options])
            words = f"{entry.words.partition(':')[0]}?" if has_pictures else entry.words  # the menu says what each option is
            with field(words, key, hint, entry.fault or ("" if entry.answer else "An answer is needed here.")):
                if has_pictures:
                    show_curve_menu(workbench, key, entry.answer, entry.options, partial(answer, entry.key), words)
                elif entry.options:
                    options = entry.options if entry.answer else (("", "choose one"), *entry.options)
                    choice(key, entry.answer, options, partial(answer, entry.key))
                else:
                    text_input(key, entry.answer, partial(answer, entry.key))


def _show_writing(workbench: Workbench, draft: Draft) -> None:
    """Show where the data set goes, and the button that writes it."""
    name = {"folder": draft.proposed_name}

    def write() -> None:
        refuse_folder_name(name["folder"])
        refuse_module_name(name["folder"])
        draft.write(workbench.folder / name["folder"])
        ui.navigate.to(address("data", name["folder"]))

    def show_init() -> None:
        files = [path.name for path in draft.files]
        command.show(shlex.join(["bowdenfit", "init", name["folder"], "--from", *files]))

    def take_name(typed: str) -> None:
        name["folder"] = typed
        if not draft.is_described:
            show_init()

    with section("Keep it", "keep"):
        with field("Name of the folder with cable.toml", "folder", f"It is written into {workbench.folder}."):
            text_input("folder", name["folder"], take_name)
        with block("div", "row"):
            button("Write the data set", lambda: attempt(write), "primary")
        if not draft.is_described:
            then = "; what is left out goes into cable.toml, as above" if draft.excluded else ""
            hint = f"In the folder of the files; it asks the same questions{then}:"
            command = EquivalentCommand([""], hint, key="init-command")
            show_init()
