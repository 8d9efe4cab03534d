"""A table that is typed or pasted, like that of a spreadsheet."""

import csv
import io
from collections.abc import Awaitable, Callable, Mapping, Sequence
from typing import Any

from nicegui.element import Element

from bowdenfit.addons.app.draft import Draft, Refusal
from bowdenfit.addons.app.elements import block, button, text, text_input
from bowdenfit.addons.app.page_words import page_words

FILE = "typed.csv"
_HEADINGS = ("input_force_N", "output_force_N", "run", "stroke", "wrap_angle_deg", "")
MORE_ROWS = 8  # at first, and each time more are wanted
_MOST_ROWS, _MOST_COLUMNS = 500, 24  # that a page shows as cells; files may have more
_PASTED = """event => {
  const words = event.clipboardData.getData("text");
  if (!/[\\t\\n]/.test(words.trim())) return;
  event.preventDefault();
  emit([words, event.target.dataset.row, event.target.dataset.column]);
}"""


def paste_cells(cells: list[list[str]], pasted: str, row: int, column: int) -> list[list[str]]:
    """Return cells with what was pasted from a spreadsheet at a place; they grow where it needs more.

    Args:
        cells: Rows of equal length, the headings first.
        pasted: Cells between tabs, or between commas or semicolons where there are no tabs.
        row, column: Where its first cell goes.
    """
    lines = pasted.strip("\r\n").splitlines()
    separator = next((mark for mark in "\t;," if mark in lines[0]), "\t")
    new = [line[:_MOST_COLUMNS] for line in csv.reader(lines, delimiter=separator)][:_MOST_ROWS]
    height, width = max(len(cells), row + len(new)), max([len(cells[0]), *(column + len(line) for line in new)])
    grown = [[*line, *[""] * (width - len(line))] for line in cells] + [[""] * width for _ in range(height - len(cells))]
    for i, line in enumerate(new):
        grown[row + i][column : column + len(line)] = [cell.strip() for cell in line]
    return grown


def to_csv(cells: Sequence[Sequence[str]]) -> str:
    """Return typed cells as CSV, without columns that are empty below their heading; empty where nothing is typed."""
    filled = [i for i, _ in enumerate(cells[0]) if any(line[i].strip() for line in cells[1:])]
    rows = [[line[i].strip() for i in filled] for line in cells]
    last = max((number for number, line in enumerate(rows) if any(line)), default=0)
    if not filled or last == 0:
        return ""
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerows(rows[: last + 1])
    return stream.getvalue()


class CellGrid:
    """Cells on a page, the headings first.

    Args:
        cells: Rows of equal length; changed as they are typed.
        on_change: Called when one has changed.
        above: Rows that stay as they are, between the headings and those to type in; with them the headings stay too.
    """

    def __init__(
        self, cells: list[list[str]], on_change: Callable[[], Awaitable[None]], above: Sequence[Sequence[str]] | None = None
    ) -> None:
        self.cells, self._on_change, self._above = cells, on_change, above
        self._inputs: dict[tuple[int, int], Element] = {}

    def show(self) -> None:
        """Show the cells below their headings."""
        with block("div", "wide", role="region", tabindex="0", aria_label="Table to type in"):
            self._place = block("table", "sheet")
        button("More rows", self._add_rows)
        self._draw()

    def mark(self, faults: Mapping[tuple[int, str], str]) -> None:
        """Mark cells that are refused.

        Args:
            faults: Why, by number of the row in `cells` and heading.
        """
        for (row, column), made in self._inputs.items():
            sentence = page_words(faults.get((row, self.cells[0][column].strip()), ""))
            if sentence != made.props.get("title", ""):
                made.props["aria-invalid"], made.props["title"] = str(bool(sentence)).lower(), sentence
                made.update()

    def _draw(self) -> None:
        """Draw all cells anew."""
        self._place.clear()
        self._inputs = {}
        with self._place, block("tbody"):
            if self._above is not None:
                with block("tr"):
                    for heading in self.cells[0]:
                        text(heading, "th", "as-it-is", scope="col", dir="auto")
                for cells in self._above:
                    with block("tr"):
                        for cell in cells:
                            text(cell, "td", "as-it-is", dir="auto")
            for row, line in enumerate(self.cells):
                if row or self._above is None:
                    with block("tr"):
                        for column, cell in enumerate(line):
                            self._draw_cell(row, column, cell)

    def _draw_cell(self, row: int, column: int, cell: str) -> None:
        """Draw one cell."""

        async def change(typed: str) -> None:
            self.cells[row][column] = typed
            await self._on_change()

        async def paste(event: Any) -> None:
            words, at_row, at_column = event.args
            self._paste(str(words), int(at_row), int(at_column))
            self._draw()
            await self._on_change()

        with block("th" if row == 0 else "td"):
            label = f"Heading of column {column + 1}" if row == 0 else f"Row {row}, column {column + 1}"
            if self._above is not None:
                label = f"{self.cells[0][column]}, new row {row}"
            made = text_input(f"cell-{row}-{column}", cell, change, label=label)
            made.props["data-row"], made.props["data-column"] = row, column
            made.on("paste", paste, js_handler=_PASTED)
        self._inputs[row, column] = made

    def _paste(self, words: str, row: int, column: int) -> None:
        """Take what was pasted; below headings that stay only what stands below them."""
        pasted = paste_cells(self.cells, words, row, column)
        if self._above is not None:
            width = len(self.cells[0])
            pasted = [line[:width] for line in pasted]
            if pasted[row] == self.cells[0]:  # copied with the headings
                pasted = [*pasted[:row], *pasted[row + 1 :]]
        self.cells[:] = pasted

    def _add_rows(self) -> None:
        width = len(self.cells[0])
        self.cells += [[""] * width for _ in range(MORE_ROWS if len(self.cells) < _MOST_ROWS else 0)]
        self._draw()


class TypedSheet:
    """The cells on the page of a draft.

    Args:
        draft: Which keeps them.
        look_again: Called when one has changed.
    """

    def __init__(self, draft: Draft, look_again: Callable[[], Awaitable[None]]) -> None:
        self._draft, self._look_again = draft, look_again
        if not draft.typed:
            draft.typed = [list(_HEADINGS), *([""] * len(_HEADINGS) for _ in range(MORE_ROWS))]
        self._sheet = CellGrid(draft.typed, self._write)

    def show(self) -> None:
        """Show the cells below their headings."""
        text("The first row holds the headings, with units. Cells can be pasted from a spreadsheet.", classes="hint")
        self._sheet.show()

    def mark(self, refusals: Sequence[Refusal]) -> None:
        """Mark the cells that refusals speak of."""
        own = [refusal for refusal in refusals if refusal.file == FILE]
        self._sheet.mark({(refusal.row - 1, refusal.column): refusal.sentence for refusal in own})

    async def _write(self) -> None:
        """Write what is typed as a file of the draft, and look at it."""
        typed = to_csv(self._draft.typed)
        if typed:
            self._draft.new_file(FILE, typed.count("\n")).write_text(typed, encoding="utf-8")
        else:
            self._draft.remove_file(FILE)
        await self._look_again()
