"""TrueType fonts in PDFs: without tables that no PDF reader looks at, and each file taken apart once, not for every figure.

matplotlib has no setting for either. It has fontTools take all of a font's thousands of letters apart for the few that a figure
needs, which takes half of the time of a PDF; here that is done once, and figures take theirs from the letters that remain.
"""

from collections.abc import Callable, Collection, Iterator, Set
from contextlib import AbstractContextManager, contextmanager, nullcontext
from functools import partial
from io import BytesIO
from typing import Any, NamedTuple

from bowdenfit.plots.style import FAMILIES

# Tables of a TrueType font that a PDF uses whose letters are named by number; ISO 32000-1, table 126.
_OF_PDF = {"head", "hhea", "loca", "maxp", "cvt ", "prep", "glyf", "hmtx", "fpgm"}
# What figures are written with: Latin and Greek, dashes, superscripts, signs of mathematics, and ligatures.
_USUAL = (*range(0x20, 0x180), *range(0x370, 0x400), *range(0x2010, 0x2090), 0x2192, 0x2212, 0x2248, *range(0xFB00, 0xFB07))
_KNOWN = (3, 11)  # version of matplotlib whose private function, which changes with versions, is stood in for
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

    of_few = _in_place_of(fonts, "get_glyphs_subset", _of_few) if _is_known() else nullcontext()
    with _in_place_of(subset, "load_font", _lean), of_few:
        yield


@contextmanager
def _in_place_of(module: Any, name: str, function: Callable[..., Any]) -> Iterator[None]:
    """A function stands in for one of a module, which it is given first."""
    usual = getattr(module, name)
    setattr(module, name, partial(function, usual))
    try:
        yield
    finally:
        setattr(module, name, usual)


def take_fonts_apart() -> None:
    """Do beforehand what the first figure would wait for."""
    if not _is_known():
        return
    from matplotlib.backends._backend_pdf_ps import get_glyphs_subset
    from matplotlib.font_manager import FontProperties, findfont

    with lean_fonts():
        for kind in _USED:
            _take_apart(get_glyphs_subset, findfont(FontProperties(family=FAMILIES, **kind)))


def _is_known() -> bool:
    """Whether this matplotlib asks for glyphs in the way that is stood in for here; any other is left to its own."""
    import matplotlib as mpl

    return mpl.__version_info__[:2] == _KNOWN


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
    from matplotlib.backends._backend_pdf_ps import font_as_file

    with usual(file, {*asked, *_places(file), *_usual_glyphs(file)}) as found:
        if "glyf" in found.font:
            _taken_apart[file] = _Few(font_as_file(found.font).getvalue(), found.glyph_index_map)


def _places(file: Any) -> Set[int]:
    return _taken_apart[file].places.keys() if file in _taken_apart else set()


def _usual_glyphs(file: Any) -> set[int]:
    from matplotlib.font_manager import get_font

    letters = get_font(file).get_charmap()
    return {letters[code] for code in _USUAL if code in letters}
