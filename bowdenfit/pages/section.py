"""What a page is made of, as plain data: any process can put it on a page."""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np

from bowdenfit.words import printable

Look: TypeAlias = Literal["line", "dashed", "low", "high", "from", "to", "points", "hollow"]
_DIGITS, _X_DIGITS = 5, 8  # significant ones: 5 are more than a screen has pixels; places may start far from zero
PICTURES = "pictures"  # in the context of a section that has some


@dataclass(frozen=True)
class Series:
    """Values that belong together.

    Args:
        label: In the key; the edges of a band, or the ends of bars, have the same.
        look: "low" and "high", one after the other, are the edges of a band, and "from" and "to" the ends of upright bars.
        color: One of the page's colors, such as "blue".
        values: At the places of their group; not finite where there are none.
        keys: What each point is called in events of a page, when it is clicked; empty where nothing listens.
    """

    label: str
    look: Look
    color: str
    values: np.ndarray
    keys: tuple[str, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """For the page's script."""
        page = vars(self) | {"values": _round_numbers(self.values)}
        return page if self.keys else {name: value for name, value in page.items() if name != "keys"}


@dataclass(frozen=True)
class SeriesGroup:
    """Series at the same places.

    Args:
        x: The places, ascending.
        series: The series.
    """

    x: np.ndarray
    series: tuple[Series, ...]


@dataclass(frozen=True)
class Span:
    """A stretch of the axis across which something holds.

    Args:
        label: In the key.
        color: One of the page's colors.
        start: From where.
        stop: To where.
    """

    label: str
    color: str
    start: float
    stop: float


@dataclass(frozen=True)
class Chart:
    """One chart.

    Args:
        name: By which it is chosen among others.
        x_label: With unit.
        y_label: With unit.
        groups: Series to draw.
        spans: Shaded ranges.
        place_names: Names of the places 1, 2 and so on; empty where they are numbers.
    """

    name: str
    x_label: str
    y_label: str
    groups: tuple[SeriesGroup, ...]
    spans: tuple[Span, ...] = ()
    place_names: tuple[str, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """For the page's script."""
        return {
            "name": printable(self.name),
            "x": printable(self.x_label),
            "y": printable(self.y_label),
            "groups": [
                {
                    "x": _round_numbers(group.x, _X_DIGITS),
                    "series": [series.to_json() for series in group.series],
                }
                for group in self.groups
            ],
            "spans": [vars(span) for span in self.spans],
            "names": [printable(name) for name in self.place_names],
        }


@dataclass(frozen=True)
class Picture:
    """A figure on a page.

    Args:
        name: Name of the figure, by which its drawing is found.
        title: Its heading, which stands for it where it is not seen.
        caption: Caption in plain words.
        charts: The same to zoom into, one after the other; none where that does not pay.
        chart_caption: Caption of the charts, which have no panels.
        folded: Whether only those who ask for it see it.
        alone: Whether its charts have no drawing, because a table beside them has the same numbers for paper.
    """

    name: str
    title: str
    caption: str
    charts: tuple[Chart, ...] = ()
    chart_caption: str = ""
    folded: bool = False
    alone: bool = False


@dataclass(frozen=True)
class PageSection:
    """A part of a page.

    Args:
        title: Its heading.
        template: File that says how its context is shown.
        context: Values by the names that the template has for them; the figures are called `PICTURES`.
    """

    title: str
    template: Path
    context: Mapping[str, Any] = field(default_factory=dict)

    @property
    def slug(self) -> str:
        """By which it is linked to."""
        return "".join(c if c.isalnum() and c.isascii() else "-" for c in self.title.lower())

    @property
    def pictures(self) -> tuple[Picture, ...]:
        """Its figures."""
        pictures: tuple[Picture, ...] = self.context.get(PICTURES, ())
        return pictures

    def with_pictures(self, names: Collection[str]) -> "PageSection":
        """The same with those figures that are among some, or need no drawing."""
        if PICTURES not in self.context:
            return self
        kept = tuple(picture for picture in self.pictures if picture.alone or picture.name in names)
        return replace(self, context={**self.context, PICTURES: kept})


@dataclass(frozen=True)
class HtmlPage:
    """A whole page.

    Args:
        title: Subject of the page.
        subtitle: Kind of page, and when it was made.
        sections: In their order.
    """

    title: str
    subtitle: str
    sections: tuple[PageSection, ...]

    @property
    def pictures(self) -> tuple[Picture, ...]:
        """All figures, in their order."""
        return tuple(picture for section in self.sections for picture in section.pictures)


@dataclass(frozen=True)
class PageTable:
    """Rows under heads.

    Args:
        heads: Headings of the columns.
        rows: Cells; the first names the row.
        caption: Above it.
        left: Columns of words, which are aligned left.
    """

    heads: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    caption: str = ""
    left: tuple[int, ...] = (0,)


def make_meanings_table(meanings: Mapping[str, str]) -> PageTable:
    """What names stand for, of those that need it."""
    named = tuple((name, meaning) for name, meaning in meanings.items() if meaning and meaning != name)
    return PageTable(("name", "what it is"), named, left=(0, 1))


def prose_section(
    title: str,
    sentences: Iterable[str],
    tables: Iterable[PageTable] = (),
    items: Iterable[str] = (),
    folded: Iterable[tuple[str, str | PageTable]] = (),
    pictures: tuple[Picture, ...] = (),
    headline: str = "",
) -> PageSection:
    """A section without a template of its own.

    Args:
        title: Its heading.
        sentences: Each a paragraph.
        tables: Below them.
        items: A list below the paragraphs.
        folded: Texts as they are printed, and tables, that only those who ask for them see, with what they are.
        pictures: Figures, at its end.
        headline: Sentence above all, in large letters.
    """
    context = {
        "headline": headline,
        "sentences": tuple(filter(None, sentences)),
        "tables": tuple(table for table in tables if table.rows),
        "items": tuple(items),
        "folded": tuple((what, text) for what, text in folded if (text.rows if isinstance(text, PageTable) else text)),
        PICTURES: pictures,
    }
    return PageSection(title, Path(__file__).with_name("prose.html"), context)


def _round_numbers(values: np.ndarray, digits: int = _DIGITS) -> list[float | None]:
    return [
        float(f"{value:.{digits}g}") if np.isfinite(value) else None for value in np.asarray(values, float).tolist()
    ]
