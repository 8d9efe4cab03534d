"""What a page is made of, as plain data: any process can put it on a page."""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from bowdenfit.pages.chart import Chart

PICTURES = "pictures"  # in the context of a section that has some


@dataclass(frozen=True)
class Picture:
    """A figure on a page.

    Args:
        name: Of the figure, by which its drawing is found.
        title: Its heading, which stands for it where it is not seen.
        caption: What it shows, in plain words.
        charts: The same to zoom into, one after the other; none where that does not pay.
        folded: Whether only those who ask for it see it.
    """

    name: str
    title: str
    caption: str
    charts: tuple[Chart, ...] = ()
    folded: bool = False


@dataclass(frozen=True)
class Section:
    """A part of a page.

    Args:
        title: Its heading.
        template: File that says how its context is shown.
        context: What is shown, by the names that the template has for it; the figures are called `PICTURES`.
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
        found: tuple[Picture, ...] = self.context.get(PICTURES, ())
        return found

    def with_pictures(self, names: Collection[str]) -> "Section":
        """The same with those figures alone that are among some."""
        if PICTURES not in self.context:
            return self
        found = tuple(picture for picture in self.pictures if picture.name in names)
        return replace(self, context={**self.context, PICTURES: found})


@dataclass(frozen=True)
class Page:
    """A whole page.

    Args:
        title: What it is of.
        subtitle: What kind of page, and when it was made.
        sections: In their order.
    """

    title: str
    subtitle: str
    sections: tuple[Section, ...]

    @property
    def pictures(self) -> tuple[Picture, ...]:
        """All figures, in their order."""
        return tuple(picture for section in self.sections for picture in section.pictures)


@dataclass(frozen=True)
class Table:
    """Rows under heads.

    Args:
        heads: Of the columns.
        rows: Cells; the first names the row.
        caption: Above it.
        left: Columns of words, which are aligned left.
    """

    heads: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    caption: str = ""
    left: tuple[int, ...] = (0,)


def meanings_table(meanings: Mapping[str, str]) -> Table:
    """What names stand for, of those that need it."""
    named = tuple((name, meaning) for name, meaning in meanings.items() if meaning and meaning != name)
    return Table(("name", "what it is"), named, left=(0, 1))


def prose(
    title: str,
    sentences: Iterable[str],
    tables: Iterable[Table] = (),
    items: Iterable[str] = (),
    folded: Iterable[tuple[str, str | Table]] = (),
    pictures: tuple[Picture, ...] = (),
    headline: str = "",
) -> Section:
    """A section without a template of its own.

    Args:
        title: Its heading.
        sentences: Each a paragraph.
        tables: Below them.
        items: A list below the paragraphs.
        folded: Texts as they are printed, and tables, that only those who ask for them see, with what they are.
        pictures: Figures, at its end.
        headline: What stands above all, in large letters.
    """
    context = {
        "headline": headline,
        "sentences": tuple(filter(None, sentences)),
        "tables": tuple(table for table in tables if table.rows),
        "items": tuple(items),
        "folded": tuple((what, text) for what, text in folded if (text.rows if isinstance(text, Table) else text)),
        PICTURES: pictures,
    }
    return Section(title, Path(__file__).with_name("prose.html"), context)
