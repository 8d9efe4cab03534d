"""Which rows of the files were read, which not and why, and how the first and the last one were understood."""

from bowdenfit.dataset import Dataset
from bowdenfit.files.row_account import RowAccount
from bowdenfit.kinds import iterate_tables
from bowdenfit.words import filled, kept_narrow


def describe_rows(dataset: Dataset) -> list[str]:
    """Describe which rows of every file of a data set were read."""
    accounts = [line for account in dataset.accounts for line in describe_row_account(account, account.file)]
    return [*describe_first_and_last_rows(dataset), *accounts]


def describe_row_account(account: RowAccount, file: str = "") -> list[str]:
    """How many rows were read, and every row that was not, with the reason; what stands beside them too.

    Args:
        account: Of a file.
        file: Its name, where several are spoken of.
    """
    over = f", headings in row{'s' if len(account.headings) > 1 else ''} {', '.join(map(str, account.headings))}"
    before = f"{file}: of" if file else "Of"
    held = "holds a reading" if account.read == 1 else "hold readings"
    lines = [f"{before} {account.rows} rows {account.read} {held}{over if account.headings else ''}."]
    unused = [each.words for each in account.left_out] + [account.beside_in_words] * bool(account.beside)
    return [*map(kept_narrow, lines), *(filled(f"Not used: {words}.", "  " if file else "") for words in unused)]


def describe_first_and_last_rows(data: Dataset) -> list[str]:
    """The first and the last row of each table as understood."""
    lines = []
    for kind, table in iterate_tables(data.measurements):
        page = kind.file_rows(table, data.description)
        if page is None:
            continue
        heads, rows = page
        for which, i in (("First", 0), ("Last", -1)):
            cells = ", ".join(f"{head} {cell}" for head, cell in zip(heads, rows[i], strict=True) if cell)
            lines.append(filled(f"{which} row, {table.origin.describe_row(i)}: {cells}."))
    return lines
