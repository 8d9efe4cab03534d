"""The page on which rows are added to a table of a data set."""

from nicegui import ui

from bowdenfit.addons.app.elements import address, block, button, link, report, text
from bowdenfit.addons.app.frame import attempt, frame, refused, section
from bowdenfit.addons.app.new_rows import CheckedRows, OpenTable, list_tables, open_table
from bowdenfit.addons.app.sheet import MORE_ROWS, CellGrid
from bowdenfit.addons.app.workbench import Workbench
from bowdenfit.words import counted

_MOST_ABOVE = 8  # rows that are there already, which a page shows; a judgement


def show_table_links(workbench: Workbench, name: str) -> None:
    """Show a link for each table of a data set to which rows can be added.

    Args:
        workbench: Where it lies.
        name: Name of the data set.
    """
    for table in list_tables(workbench.data_set(name)):
        link(f"Add rows to {table}", address("table", name, file=table), "button")


class AddRowsPage:
    """The page of one table.

    Args:
        workbench: Where its data set lies.
        name: Name of the data set.
        file: File of the table, as seen from the data set.

    Raises:
        UsageError, DatasetError, StoreError: See `open_table`.
    """

    def __init__(self, workbench: Workbench, name: str, file: str) -> None:
        self._workbench, self._name = workbench, name
        self._table: OpenTable = open_table(workbench.data_set(name), file)
        headings, above = list(self._table.headings), self._table.rows[-_MOST_ABOVE:]
        cells = [headings, *([""] * len(headings) for _ in range(MORE_ROWS))]
        self._sheet = CellGrid(cells, self._look, above)
        title = workbench.title_of(name)
        with frame(f"Add rows to {file}", ((title, address("data", name)),)):
            rows = counted(len(self._table.rows), "row")
            last = f", of which the last {len(above)} stand here" if len(above) < len(self._table.rows) else ""
            text(f"{file} has {rows}{last}. Type what was measured below, or paste it from a spreadsheet.")
            self._sheet.show()
            self._place = block("div", role="status")
            self._show(CheckedRows(0))

    @property
    def _filled(self) -> dict[int, list[str]]:
        """Rows that are filled in, by their number in the sheet."""
        stripped = [[cell.strip() for cell in line] for line in self._sheet.cells]
        return {number: line for number, line in enumerate(stripped) if number and any(line)}

    async def _look(self) -> None:
        """Check what is typed."""
        filled = self._filled
        checked = await self._workbench.compute(self._table.check, list(filled.values()))
        if filled == self._filled:  # nothing was typed meanwhile
            first = self._table.last_row + 1
            numbers = dict(enumerate(filled, start=first))
            own = [refusal for refusal in checked.refusals if refusal.file == self._table.path.name]
            self._sheet.mark({(numbers.get(refusal.row, 0), refusal.column): refusal.sentence for refusal in own})
            self._show(checked)

    def _show(self, checked: CheckedRows) -> None:
        """Show what is said of the rows, and the button that adds them."""
        self._place.clear()
        with self._place:
            if checked.refusals:
                refused("\n".join(refusal.sentence for refusal in checked.refusals))
                text(f"{self._table.name} is as it was.", classes="hint")
            elif checked.count:
                with block("div", "row"):
                    button(f"Add {counted(checked.count, 'row')}", lambda: attempt(self._save), "primary", key="add-rows")
                if checked.report:
                    with section("How it was read with them", "understood"):
                        report(checked.report)

    async def _save(self) -> None:
        """Add the rows, and show the data set.

        Raises:
            UsageError, StoreError: They are refused, or the file cannot be replaced.
        """
        await self._workbench.compute(self._table.save, list(self._filled.values()))
        ui.navigate.to(address("data", self._name))
