"""What stands in one cell of a sheet: a number in any laboratory's spelling, a mark for none, a date, or words."""

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

from bowdenfit.errors import DatasetError
from bowdenfit.files.clocks import is_date
from bowdenfit.words import listed, shown

Kind = Literal["number", "date", "blank", "text"]
_UNDETECTED = re.compile(r"(?:<=|<|≤|&lt;)(?P<limit>.*)", re.DOTALL)
_NUMBER = re.compile(r"[+-]?(?=[.,]?\d)\d*(?:(?P<mark>[.,])\d*)?(?:[eE][+-]?\d+)?")
_GROUPED = re.compile(r"[+-]?[1-9]\d{0,2}(?P<separator>[ '.,])\d{3}(?:(?P=separator)\d{3})*(?:(?P<mark>[.,])\d+)?")
_AMBIGUOUS = re.compile(r"[+-]?[1-9]\d{0,2}[.,]\d{3}")
_FRACTION = re.compile(r"(?:(?P<whole>\d{1,4}) )?(?P<over>\d{1,2})/(?P<under>2|3|4|5|6|8|10|12|16|32|64)")  # 2 1/4 turns
_WHOLE = re.compile(r"[+-]?[1-9]\d{2,}")
_MISSING_CODE = re.compile(r"-(?:9{2,}(?:[.,](?:9+|0+))?|32768)")
_SPACES = "\t\v\f\x85\xa0\u2000\u2001\u2002\u2003\u2004\u2005\u2006\u2007\u2008\u2009\u200a\u202f\u205f\u3000"
_TYPOGRAPHY = str.maketrans({"\u2212": "-", "’": "'", **dict.fromkeys(_SPACES, " ")})
_EXCEL_MARKS = "#n/a #na #nv #n/d #div/0! #value! #wert! #valeur! #num! #zahl! #ref! #bezug!"
_NAN_MARKS = "--- <na> nan -nan +nan 1.#qnan -1.#ind"
_INFINITE = "inf +inf -inf infinity -infinity ∞ -∞ +∞ 1.#inf -1.#inf"
_OVERFLOW = "overflow +overflow -overflow overrange overload ovld ovrflw"
AS_DECIMALS = "has three digits behind its mark"
"""How a remark on columns that could hold thousands begins, which the page of a fit repeats."""
BLANK = frozenset({"", "-", "--", "n/a", "na", "n.a.", "n. a.", "k.a.", "k. a.", "n.d.", "nd", "none", "null"})
NOT_FINITE = frozenset(f"{_EXCEL_MARKS} {_NAN_MARKS} {_INFINITE} {_OVERFLOW}".split())
MISSING = BLANK | NOT_FINITE
"""What recordings have in the place of a missing sample; a table may leave cells blank, but not be infinite."""


@dataclass(frozen=True)
class Decimals:
    """How a file writes decimals.

    Args:
        comma: Whether a lone comma is a decimal one, as in files separated by semicolons or tabs.
        seen: The first number that can only be read with a decimal point, and with a decimal comma.
        whole: The first whole number beside which three digits behind a mark may be thousands; empty where there is none.
    """

    comma: bool = False
    seen: dict[str, str] = field(default_factory=dict)
    whole: str = ""

    @classmethod
    def of(cls, texts: Iterable[str], comma: bool) -> "Decimals":
        """Return what the numbers of a file say about its decimal sign."""
        seen: dict[str, str] = {}
        for text in texts:
            if "," in text or "." in text:
                plain = _normalize(text.strip(" <=≤%"))
                match = _NUMBER.fullmatch(plain) or _GROUPED.fullmatch(plain)
                if match and match["mark"] and match.start("mark") > 0 and not _AMBIGUOUS.fullmatch(plain):
                    seen.setdefault(match["mark"], plain)
        return cls(comma, seen)

    def of_columns(self, columns: Sequence[Sequence[str]]) -> list["Decimals"]:
        """Return decimals of each column: with its own first whole number of three digits or more, if it has one.

        A column in which every number has three digits behind a mark, of which the last is 0, may hold thousands too; where
        all such numbers of the file are so round, a whole number of another column speaks for that.
        """
        wholes = [next((text.strip() for text in texts if _WHOLE.fullmatch(text.strip())), "") for texts in columns]
        marked = [[text.strip() for text in texts if _AMBIGUOUS.fullmatch(text.strip())] for texts in columns]
        if all(text.endswith("0") for texts in marked for text in texts):
            other = next(filter(None, wholes), "")
            for i, texts in enumerate(columns):
                if len(marked[i]) > 1 and len(marked[i]) == sum(map(is_plain_number, texts)):
                    wholes[i] = other
        return [replace(self, whole=whole) for whole in wholes]

    def likely_thousands(self, columns: Sequence[Sequence[str]], mark: str = ".") -> list[tuple[int, str]]:
        """Return columns in which every number has three digits behind a mark, though nothing in the file makes it decimal.

        Args:
            columns: The cells of each column.
            mark: The mark.

        Returns:
            Position of each such column, and its first number; none where commas separate columns.
        """
        likely = []
        for i, texts in enumerate(columns) if self.comma else ():
            numbers = [text.strip() for text in texts if is_plain_number(text)]
            if len(numbers) > 1 and mark not in self.seen and all(mark in n and _AMBIGUOUS.fullmatch(n) for n in numbers):
                likely.append((i, numbers[0]))
        return likely

    def other(self, mark: str) -> str | None:
        """Return a number of the file that speaks against `mark` being decimal."""
        return self.seen.get("," if mark == "." else ".")


@dataclass(frozen=True)
class Cell:
    """One cell with its place, for errors that can be found again in the file.

    Args:
        file, row, column: Where it stands.
        text: Text of the cell.
        decimals: How its column writes decimals.
        measured: The number without its unit and error where these stand in the cell too; else None.
        unit: The unit that stands in the cell; empty without one.
        is_code: Whether it holds what the user states as the code of a missing reading.
    """

    file: str
    row: int
    column: str
    text: str
    decimals: Decimals = Decimals()
    measured: str | None = None
    unit: str = ""
    is_code: bool = False

    def refuse(self, what: str) -> DatasetError:
        """Return an error that names this cell."""
        error = DatasetError(f"{self.file}, row {self.row}, column {shown(self.column)}: {what}")
        error.fault_key, error.row = (self.file, self.column, what.replace(self.shown, "")), self.row
        return error

    @property
    def shown(self) -> str:
        """What stands in the cell, for an error message."""
        return shown(self.text)

    @property
    def blank(self) -> bool:
        """Whether nothing was written here (or one of the usual marks for nothing, or a stated code)."""
        return self.is_code or self.text.strip().lower() in BLANK

    def number(self) -> float:
        """Return the number in this cell.

        Raises:
            DatasetError: The cell is blank, is text, or is not finite.
        """
        if self.blank:
            what = f"{self.shown} is stated as a missing-value code" if self.is_code else "the cell is blank"
            raise self.refuse(f"{what}; fill in the value or delete the row.")
        return self._parse(self._number)

    @property
    def _number(self) -> str:
        return self.text if self.measured is None else self.measured

    def refuse_missing_code(self, remedy: str = "delete the row") -> None:
        """Refuse a negative number that programs write where a reading is missing, such as -9999.

        Raises:
            DatasetError: It holds such a number.
        """
        if _MISSING_CODE.fullmatch(_normalize(self._number)):
            code = self._number.strip()
            raise self.refuse(
                f"{self.shown} is a code that programs write where a reading is missing; {remedy}, or state the code: "
                f"--missing {code} (in cable.toml missing = [{code.replace(',', '.')}] next to the file)."
            )

    def percentage(self) -> float | None:
        """Return the number where the cell itself carries a percent sign ("78.5 %"), else None."""
        text = self._number.strip()
        return self._parse(text[:-1]) / 100 if text.endswith("%") else None

    def limit(self) -> float | None:
        """Return the number behind a less-than sign ("<10"), else None."""
        match = _UNDETECTED.fullmatch(self._number.strip())
        return self._parse(match["limit"]) if match else None

    def no_sample(self, decimal: str) -> DatasetError:
        """Return an error that says why this cell is no sample of a recording with this decimal mark."""
        other = "," if decimal == "." else "."
        mixed = parse_number(self.text, other) is not None
        return self.refuse(
            f"{self.shown} is not a number"
            + (f" like the others, which have a decimal {'comma' if other == '.' else 'point'}" if mixed else "")
            + "; correct the cell, or leave it blank if the sample is missing."
        )

    def _parse(self, text: str) -> float:
        plain = _normalize(text)
        if plain.lower() in NOT_FINITE:
            raise self.refuse(f"{self.shown} is not a finite number; correct the value or delete the row.")
        if _AMBIGUOUS.fullmatch(plain):
            self._refuse_ambiguous(plain)
        written = _with_decimal_point(plain)
        if written is None:
            raise self.refuse(
                f"{self.shown} is not a number; write a plain number there "
                "(put comments in a line that starts with #, or below the table after an empty row)."
            )
        if not math.isfinite(float(written)):
            raise self.refuse(f"{self.shown} is too large for a number; correct the value.")
        return float(written)

    def _refuse_ambiguous(self, text: str) -> None:
        """Refuse three digits behind a separator, unless the file leaves no doubt that they are decimals."""
        mark = "," if "," in text else "."
        remedy = ""
        if mark == "," and not self.decimals.comma:
            remedy = "; write it without a thousands separator and with a decimal point."
        elif self.decimals.whole and mark not in self.decimals.seen:
            remedy = (
                f", because the file also has {shown(self.decimals.whole)}; write it without a separator of thousands, or "
                "with a decimal point and a number of digits other than three."
            )
        elif against := self.decimals.other(mark):
            remedy = (
                f", because elsewhere the file has {shown(against)}; write all its decimals the same way, and no thousands "
                "separators."
            )
        if remedy:
            error = self.refuse(f"{self.shown} may mean {text.replace(mark, '')} or {text.replace(mark, '.')}{remedy}")
            error.fault_key = (self.file, self.column, "thousands")
            raise error


def remark_on_thousands(file: str, headings: Sequence[str], thousands: Sequence[tuple[int, str]]) -> tuple[str, ...]:
    """Return the remark on columns that are read with decimals, although they may hold thousands; none without any.

    Args:
        file: Name of the file.
        headings: Heading of each column.
        thousands: What `Decimals.likely_thousands` gives.
    """
    if not thousands:
        return ()
    names = listed([shown(headings[i]) for i, _ in thousands])
    return (
        f"{file}: every number under {names} {AS_DECIMALS}, as in {shown(thousands[0][1])}, and is read with decimals; "
        "if these are thousands, write the numbers without that mark.",
    )


def parse_number(text: str, decimal: str) -> float | None:
    """Return the number of a recording with one decimal mark, NaN where it is missing, None where there is text.

    Thousands are read where their separator cannot be a decimal mark: a blank or an apostrophe, and a comma or point only
    before the decimal mark that is the other one.
    """
    match = _NUMBER.fullmatch(text) or _NUMBER.fullmatch(plain := _normalize(text))
    if match:
        return float(match[0].replace(",", ".")) if match["mark"] in (None, decimal) else None
    grouped = _GROUPED.fullmatch(plain)
    if grouped and grouped["separator"] != decimal and (grouped["mark"] or grouped["separator"] in " '"):
        digits = plain.replace(grouped["separator"], "").replace(",", ".")
        return float(digits) if grouped["mark"] in (None, decimal) else None
    return math.nan if plain.lower() in MISSING else None


def classify_cell(text: str, decimal: str) -> Kind:
    """Return what stands in a cell of a recording."""
    value = parse_number(text, decimal)
    if value is not None:
        return "blank" if math.isnan(value) else "number"
    return "date" if is_date(text.strip()) else "text"


def is_plain_number(text: str) -> bool:
    """Return whether a text is a number in any spelling, with separators of thousands where they belong."""
    return _with_decimal_point(_normalize(text)) is not None


def _normalize(text: str) -> str:
    """Return a number without the finer points of typography."""
    return text.strip().translate(_TYPOGRAPHY)


def _with_decimal_point(text: str) -> str | None:
    """Return the number in Python's spelling, or None if it is none; separators of thousands must stand where they belong."""
    if _NUMBER.fullmatch(text):
        return text.replace(",", ".")
    if (fraction := _FRACTION.fullmatch(text)) and int(fraction["over"]) < int(fraction["under"]):
        return repr(int(fraction["whole"] or 0) + int(fraction["over"]) / int(fraction["under"]))
    grouped = _GROUPED.fullmatch(text)
    if grouped is None or grouped["mark"] == grouped["separator"]:
        return None
    return text.replace(grouped["separator"], "").replace(",", ".")
