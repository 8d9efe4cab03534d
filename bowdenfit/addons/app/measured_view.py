"""What was measured, on pages of drafts and data sets: what `check` says, charts before any fit, and the rows of the files."""

from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeAlias

from nicegui import ui

from bowdenfit.addons.app.angle_charts import fit_curves
from bowdenfit.addons.app.data_charts import make_pictures
from bowdenfit.addons.app.description_edit import preview_exclusion
from bowdenfit.addons.app.draft import Refusal
from bowdenfit.addons.app.elements import block, button, field, link, markup, text, text_input
from bowdenfit.addons.app.elements import report as report_text
from bowdenfit.addons.app.equivalent_command import EquivalentCommand
from bowdenfit.addons.app.frame import attempt
from bowdenfit.addons.app.measured_rows import LEFT_OUT, READ, FileRow, FileRows, MeasuredRows, collect_rows
from bowdenfit.addons.app.page_words import page_words
from bowdenfit.addons.app.points import parse_sample_key, row_key
from bowdenfit.addons.app.recorded_parts import KIND, ChangePart, RecordedParts
from bowdenfit.addons.app.refused_recordings import sketch_refused
from bowdenfit.addons.app.workbench import Workbench
from bowdenfit.errors import BowdenfitError
from bowdenfit.kinds import iterate_tables
from bowdenfit.pages.page import render_section
from bowdenfit.pages.section import Picture, prose_section
from bowdenfit.words import counted, printable

if TYPE_CHECKING:
    from bowdenfit.questions.check.data_set_words import Report

Warnings: TypeAlias = Mapping[str, Sequence[str]]
_BY_USER = "left out by the user"  # in notes that stay in sight
_MOST_ROWS = 400  # of a file, that a page shows; a judgement
_MOST_COLUMNS = 12  # of a row; a judgement
_ROW_CLICKED = """event => {
  const made = event.target.closest("button[data-file]");
  if (made) emit([made.dataset.file, made.dataset.row]);
}"""


class MeasuredView:
    """Charts of what was measured, and tables of its rows.

    Args:
        workbench: Which works out what takes a while.
        folder: The data set.
        change: Leaves a part out (kind, file, part, reason), or takes it in again where the reason is None; None where
            nothing can be changed.
    """

    def __init__(self, workbench: Workbench, folder: Path, change: ChangePart | None = None) -> None:
        self._workbench, self._folder, self._change = workbench, folder, change
        self._measured = MeasuredRows()
        self._sketches: tuple[Picture, ...] = ()
        self._parts: RecordedParts | None = None

    async def show(self, refusals: tuple[Refusal, ...] = (), warnings: Warnings = MappingProxyType({})) -> None:
        """Show charts and rows here; the curves of wrap angles follow once they are worked out.

        Args:
            refusals: Why the data set is refused.
            warnings: Warnings about each kind of table, which are shown next to its rows.
        """
        charts, self._rows = block("div", id="charts"), block("div", id="rows")
        self._measured = await self._workbench.compute(collect_rows, self._folder, refusals)
        recordings = [self._folder / recorded.file for recorded in self._measured.recorded]
        self._sketches = await self._workbench.compute(sketch_refused, recordings, refusals)
        with charts:
            place = markup(self._render_charts(()), "div")
            place.on("pick", self._pick, js_handler="event => emit(event.detail)")
        with self._rows:
            files, recorded = self._measured.files, [KIND] if self._measured.recorded else []
            for kind in dict.fromkeys([*recorded, *warnings, *(file.kind for file in files)]):
                with block("div", id=f"about-{kind}"):
                    for warning in warnings.get(kind, ()):
                        _show_warning(warning)
                    if kind in recorded and self._change is not None:
                        self._parts = RecordedParts(self._folder, self._measured.recorded, self._change)
                    for file in (file for file in files if file.kind == kind):
                        self._show_rows(file)
        dataset = self._measured.dataset
        if dataset is not None and dataset.description.curved:
            try:
                curves = await self._workbench.compute(fit_curves, dataset)
            except BowdenfitError:
                return
            place.set_content(self._render_charts(curves))

    def _render_charts(self, curves: Any) -> str:
        """Return the charts as HTML."""
        pictures = make_pictures(self._measured, curves, self._change is not None)
        return render_section(prose_section("", (), pictures=(*self._sketches, *pictures)), {})

    def _pick(self, event: Any) -> None:
        """Take a click on a recording; of any other point the page shows the row itself."""
        sample = parse_sample_key(str(event.args))
        file = self._measured.find_recorded(sample[0]) if sample else None
        if sample and file is not None and self._parts is not None:
            self._parts.pick(file.file, sample[1])

    def _show_rows(self, file: FileRows) -> None:
        """Show the rows of a file, those that are not used marked."""
        unused = [row for row in file.rows if row.state != READ]
        count = f"{counted(len(file.rows), 'row')} of readings" + (f", {len(unused)} not used" if unused else "")
        with block("details") as part:
            text(f"{file.file}: {count}", "summary")
            reasons = block("div", aria_live="polite")
            table = markup(_render_rows(file, self._change is not None), "div")
            if len(file.rows) > _MOST_ROWS:
                text(f"The first {_MOST_ROWS} rows, and those that are not used.", classes="hint")
        if unused:
            part.props["open"] = True

        async def ask(event: Any) -> None:
            await self._ask_reason(file, int(event.args[1]), reasons)

        if self._change is not None:
            table.on("click", ask, js_handler=_ROW_CLICKED)

    async def _ask_reason(self, file: FileRows, number: int, place: Any) -> None:
        """Ask why a row is left out; one that is left out is taken in again."""
        change = self._change
        row = next((row for row in file.rows if row.row == number), None)
        if change is None or row is None:
            return
        if row.state == LEFT_OUT:
            await attempt(lambda: change(file.kind, file.file, number, None))
            return
        typed = {"reason": ""}

        def take_reason(words: str) -> None:
            typed["reason"] = words
            lines.show(preview_exclusion(self._folder, file.kind, file.file, number, words))

        async def leave_out() -> None:
            await attempt(lambda: change(file.kind, file.file, number, typed["reason"]))

        place.clear()
        with place, block("div", "asked"):
            hint = "It is saved in cable.toml, and stands in the report."
            with field(f"Why is row {number} of {file.file} left out?", "reason", hint):
                text_input("reason", "", take_reason)
            with block("div", "row"):
                button(f"Leave row {number} out", leave_out, "primary", key="leave-out")
                button("Keep it", place.clear)
            preview = preview_exclusion(self._folder, file.kind, file.file, number, "...")
            lines = EquivalentCommand([preview], "In cable.toml:", key="exclude-lines")
        ui.run_javascript("document.getElementById('reason')?.focus()")


def sort_warnings(report: "Report") -> Warnings:
    """Return the warnings about each kind of table, by its name; under an empty name those about none.

    Args:
        report: A data set that was checked.
    """
    tables = list(iterate_tables(report.measurements))
    of_kinds = {kind.name: kind.warnings(table, report.description, report.measurements) for kind, table in tables}
    files = {kind.name: getattr(getattr(table, "origin", None), "files", ()) for kind, table in tables}
    by_kind: dict[str, list[str]] = {}
    for warning in report.warnings:
        about = [kind for kind in of_kinds if warning in of_kinds[kind]]
        named = [kind for kind in files if any(file in warning for file in files[kind])]
        by_kind.setdefault(next(iter([*about, *named]), ""), []).append(warning)
    return by_kind


def _show_warning(warning: str) -> None:
    """Show a warning where it belongs."""
    with block("div", "verdict doubtful"):
        text(page_words(f"Warning: {warning}"))


def show_checked(report: "Report", warnings: Warnings) -> None:
    """Show what was understood of a data set, and the way to each warning; all that the command line prints on request."""
    for warning in warnings.get("", ()):
        _show_warning(warning)
    if located := {kind: sentences for kind, sentences in warnings.items() if kind}:
        with block("ul", "links"):
            for kind, sentences in located.items():
                with block("li"):
                    link(f"{counted(len(sentences), 'warning')} about the table of {kind}", f"#about-{kind}")
    text(f"Everything could be read. {'' if report.warnings else 'Nothing is wrong.'}", classes="state good")
    tables = iterate_tables(report.measurements)
    described = [(kind.heading, kind.describe(table, report.description)) for kind, table in tables]
    with block("ul"):
        for line in (line for heading, lines in described if not heading for line in lines):
            text(line.strip(), "li")
        excluded = [remark for remark in report.measurements.remarks if _BY_USER in remark]
        for remark in excluded:
            text(page_words(remark), "li", "hint")
    if others := [remark for remark in report.measurements.remarks if remark not in excluded]:
        with block("details"):
            text(counted(len(others), "note"), "summary")
            with block("ul"):
                for remark in others:
                    text(page_words(remark), "li", "hint")
    for heading, lines in described:
        if heading:
            with block("details"):
                text(heading, "summary")
                report_text("\n".join(lines))
    with block("details"):
        text("Everything that was read", "summary")
        report_text(str(report))


def _render_rows(file: FileRows, can_change: bool) -> str:
    """Return the rows of a file as an HTML table; whatever stands in a cell stays text."""
    shown = [row for i, row in enumerate(file.rows) if i < _MOST_ROWS or row.state != READ]
    heads = "".join(f'<th scope="col" dir="auto">{escape(printable(head))}</th>' for head in file.headings[:_MOST_COLUMNS])
    name, last = escape(printable(file.file)), '<th scope="col" class="left">use</th>'
    body = "".join(_render_row(file, row, can_change) for row in shown)
    return (
        f'<div class="wide rows" role="region" tabindex="0" aria-label="Rows of {name}"><table><thead><tr>'
        f'<th scope="col">row</th>{heads}{last}</tr></thead><tbody>{body}</tbody></table></div>'
    )


def _render_row(file: FileRows, row: FileRow, can_change: bool) -> str:
    """Return one row, with what becomes of it."""
    cells = "".join(f'<td dir="auto">{escape(printable(cell))}</td>' for cell in row.cells[:_MOST_COLUMNS])
    words = "Use it again" if row.state == LEFT_OUT else "Leave out"
    name, key = escape(printable(file.file)), escape(row_key(Path(file.file).name, row.row))
    change = (
        f'<button type="button" data-file="{name}" data-row="{row.row}" aria-label="{words}: row {row.row} of {name}">'
        f"{words}</button>"
    )
    state = "" if row.state == READ else f"{row.state}: {escape(page_words(printable(row.why)))} "
    kind = {LEFT_OUT: "left-out", READ: ""}.get(row.state, "refused")
    return (
        f'<tr tabindex="-1" class="{kind}" data-row-key="{key}"><th scope="row">{row.row}</th>{cells}'
        f'<td class="left">{state}{change if can_change else ""}</td></tr>'
    )
