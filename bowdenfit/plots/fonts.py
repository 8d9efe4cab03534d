"""TrueType fonts in PDFs: without tables that no PDF reader looks at, and each file taken apart once, not for every figure.

matplotlib has no setting for either. It has fontTools take all of a font's thousands of letters apart for the few that a figure
needs, which takes half of the time of a PDF; here that is done once, and figures take theirs from the letters that remain.
"""

from collections.abc import Callable, Collection, Iterator, Set
from contextlib import AbstractContextManager, contextmanager
from functools import partial
from inspect import signature
from io import BytesIO
from typing import Any, NamedTuple

from bowdenfit.plots.style import FAMILIES

# Tables of a TrueType font that a PDF uses whose letters are named by number; ISO 32000-1, table 126.
_OF_PDF = {"head", "hhea", "loca", "maxp", "cvt ", "prep", "glyf", "hmtx", "fpgm"}
# What figures are written with: Latin and Greek, dashes, superscripts, signs of mathematics, and ligatures.
_USUAL = (*range(0x20, 0x180), *range(0x370, 0x400), *range(0x2010, 0x2090), 0x2192, 0x2212, 0x2248, *range(0xFB00, 0xFB07))

_USED: tuple[dict[str, Any], ...] = {}, {"weight": "bold"}, {"style": "oblique"}  # of words, headings and symbols

Subset = Callable[[Any, set[int]], AbstractContextManager[Any]]


class _Few(NamedTuple):
    """A font of some of the glyphs of a file.

    Args:
        data: The font.
        places: The number of each glyph in it, by that in the file.
    """

    data: bytes
    places: dict[int, int]


class _FewAsFile(BytesIO):
    """Such a font, where a file is asked for."""

    face_index = 0


_taken_apart: dict[Any, _Few] = {}


@contextmanager
def lean_fonts() -> Iterator[None]:
    """PDFs that are written meanwhile are the same as ever, but for tables that they have no use for."""
    from fontTools import subset
    from matplotlib.backends import _backend_pdf_ps as fonts

    load, usual = subset.load_font, fonts.get_glyphs_subset
    subset.load_font = partial(_lean, load)
    if _asks_for_glyphs(usual):
        fonts.get_glyphs_subset = partial(_of_few, usual)
    try:
        yield
    finally:
        subset.load_font, fonts.get_glyphs_subset = load, usual


def take_fonts_apart() -> None:
    """Do beforehand what the first figure would wait for."""
    from matplotlib.backends._backend_pdf_ps import get_glyphs_subset
    from matplotlib.font_manager import FontProperties, findfont

    with lean_fonts():
        for kind in _USED if _asks_for_glyphs(get_glyphs_subset) else ():
            _take_apart(get_glyphs_subset, findfont(FontProperties(family=FAMILIES, **kind)))


def _asks_for_glyphs(usual: Callable[..., Any]) -> bool:
    """Whether this matplotlib asks for glyphs by number, as it does from 3.11 on; before, it asked for letters."""
    return "glyphs" in signature(usual).parameters


def _lean(load: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
    """A font without tables that a PDF does not use, which take longer to read than those that it does."""
    font = load(*arguments, **options)
    for table in set(font.reader.keys()) - _OF_PDF if "glyf" in font else ():
        del font[table]
    return font


@contextmanager
def _of_few(usual: Subset, file: Any, glyphs: Collection[int]) -> Iterator[Any]:
    """Some glyphs of a font file, as matplotlib takes them, from the few of that file that have been asked for yet."""
    asked = set(glyphs)
    if not asked <= _places(file):
        _take_apart(usual, file, asked)
    if not asked <= _places(file):  # it is no TrueType font
        with usual(file, asked) as found:
            yield found
        return
    few = _taken_apart[file]
    with usual(_FewAsFile(few.data), {few.places[glyph] for glyph in asked}) as found:
        yield found._replace(glyph_index_map={glyph: found.glyph_index_map[few.places[glyph]] for glyph in asked})


def _take_apart(usual: Subset, file: Any, asked: Collection[int] = ()) -> None:
    """Keep the few glyphs of a file that are asked for, were asked for, or may be."""
    with usual(file, {*asked, *_places(file), *_usual_glyphs(file)}) as found:
        if "glyf" in found.font:
            _taken_apart[file] = _Few(_bytes_of(found.font), found.glyph_index_map)


def _places(file: Any) -> Set[int]:
    return _taken_apart[file].places.keys() if file in _taken_apart else set()


def _usual_glyphs(file: Any) -> set[int]:
    from matplotlib.font_manager import get_font

    letters = get_font(file).get_charmap()
    return {letters[code] for code in _USUAL if code in letters}


def _bytes_of(font: Any) -> bytes:
    written = BytesIO()
    font.save(written, reorderTables=False)
    return written.getvalue()
