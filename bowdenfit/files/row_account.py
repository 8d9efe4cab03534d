"""Where the rows of a file went: every one is read, holds headings, or is left out for a reason."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from bowdenfit.words import few, shown

BLANK, COMMENT, ABOVE, BELOW = "blank", "a comment", "above the headings", "below the table"
BETWEEN, AGAIN = "a remark between the rows", "the headings again"
BY_USER = "left out by the user: "
"""Begins the reason of rows that a description leaves out, of which it says so itself."""
_USUAL = (BLANK, COMMENT)  # reasons that nobody needs to hear of where nothing else is left out
_RANGES, _TEXTS = 4, 3  # that are named


@dataclass(frozen=True)
class LeftOut:
    """Rows that are not read, for one reason.

    Args:
        why: The reason, behind the words "not used, ".
        ranges: First and last of the rows that stand together.
        texts: Texts of the first of them.
    """

    why: str
    ranges: tuple[tuple[int, int], ...]
    texts: tuple[str, ...] = ()

    @property
    def count(self) -> int:
        """How many rows they are."""
        return sum(last - first + 1 for first, last in self.ranges)

    @property
    def words(self) -> str:
        """Which rows, why, and what the first of them say."""
        many = self.count > 1
        place = few([f"{first} to {last}" if last > first else f"{first}" for first, last in self.ranges], _RANGES)
        quotes = f" ({', '.join(shown(text) for text in self.texts)}{', ...' if self.count > len(self.texts) else ''})"
        return f"row{'s' if many else ''} {place}: {self.why}{quotes if self.texts else ''}"


@dataclass(frozen=True)
class ExcludedReading:
    """A row of readings that its user leaves out.

    Args:
        file: Name of its file, without folders.
        row: Its number there.
        values: Numbers in it by quantity, in internal units.
    """

    file: str
    row: int
    values: dict[str, float]


@dataclass(frozen=True)
class RowAccount:
    """Where the rows of a file went; `read`, `headings` and `left_out` together are all of them.

    Args:
        file: Its name.
        rows: Number of its rows.
        read: How many hold readings.
        headings: The rows that hold headings and their units.
        left_out: All others.
        beside: Row and text of remarks in rows that are read, beside the table.
        note: Remark on its cells, as a clause; empty without.
        excluded: Readings that the user leaves out.
    """

    file: str
    rows: int
    read: int
    headings: tuple[int, ...] = ()
    left_out: tuple[LeftOut, ...] = ()
    beside: tuple[tuple[int, str], ...] = ()
    note: str = ""
    excluded: tuple[ExcludedReading, ...] = ()

    @property
    def accounted(self) -> int:
        """How many rows are accounted for."""
        return self.read + len(self.headings) + sum(group.count for group in self.left_out)

    @property
    def remarks(self) -> list[str]:
        """What is said of rows whose loss may matter, in sentences."""
        unusual = [group for group in self.left_out if group.why not in _USUAL and not group.why.startswith(BY_USER)]
        sentences = [f"{self.file}, {group.words}; not used." for group in unusual]
        sentences += [f"{self.file}, {self.beside_in_words}; not used."] * bool(self.beside)
        return sentences + [f"{self.file}: {self.note}."] * bool(self.note)

    @property
    def beside_in_words(self) -> str:
        """What stands beside the table."""
        texts = few([f"{shown(text)} in row {row}" for row, text in self.beside], _TEXTS)
        return f"next to the table: {texts}"

    def without_rows(self, reasons: Mapping[int, str], excluded: tuple[ExcludedReading, ...] = ()) -> "RowAccount":
        """Return the account where some of the rows that are read are left out after all.

        Args:
            reasons: Why each of them is, by its number.
            excluded: What is in those that the user leaves out.
        """
        left_out = _group_by_reason({row: (reason, "") for row, reason in reasons.items()})
        excluded = (*self.excluded, *excluded)
        return replace(self, read=self.read - len(reasons), left_out=(*self.left_out, *left_out), excluded=excluded)


def make_account(
    file: str, rows: int, headings: Iterable[int], reasons: Mapping[int, tuple[str, str]], beside: Iterable[tuple[int, str]]
) -> RowAccount:
    """Return the account of a file of which some rows are not read.

    Args:
        file: Its name.
        rows: Number of its rows.
        headings: The rows that hold headings and their units.
        reasons: Why a row is not read, and what it says; by its number.
        beside: Row and text of remarks beside the table.
    """
    over = tuple(headings)
    return RowAccount(file, rows, rows - len(over) - len(reasons), over, _group_by_reason(reasons), tuple(beside))


def _group_by_reason(reasons: Mapping[int, tuple[str, str]]) -> tuple[LeftOut, ...]:
    """Return the rows that are not read by reason, from why each is not and what it says."""
    ranges: dict[str, list[tuple[int, int]]] = {}
    texts: dict[str, list[str]] = {}
    for row in sorted(reasons):
        cause, text = reasons[row]
        of_reason, of_texts = ranges.setdefault(cause, []), texts.setdefault(cause, [])
        if of_reason and of_reason[-1][1] == row - 1:
            of_reason[-1] = (of_reason[-1][0], row)
        else:
            of_reason.append((row, row))
        if text and len(of_texts) < _TEXTS:
            of_texts.append(text)
    return tuple(LeftOut(reason, tuple(ranges[reason]), tuple(texts[reason])) for reason in ranges)
