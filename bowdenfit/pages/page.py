"""Sections to one HTML page that stands alone: no request, no script but its own, and whatever is a name stays text."""

from __future__ import annotations

import base64
import hashlib
import struct
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from jinja2.utils import htmlsafe_json_dumps
from markupsafe import Markup

from bowdenfit.pages.section import HtmlPage, PageSection, Picture
from bowdenfit.words import printable, unbroken

MOST_BYTES = 3_000_000  # of a page, so that it can be mailed; a judgement
TOO_LARGE = "<p>This figure would make the page too large; it is in the folder of figures.</p>"
_PNG = b"\x89PNG\r\n\x1a\n"  # its first bytes; width and height follow in the first block
_CSS_PIXELS = 0.6  # of a page for one of a figure: 96 in an inch for 160
_COLUMN = 576  # px of a page, 6 in: wider figures take both columns of a printed page
_NOTHING = "'none'"  # as policies write it
_HERE, _MARK = Path(__file__).parent, "\0"  # which no text on a page has
_STYLES = (_HERE / "page.css", _HERE / "uplot" / "uPlot.min.css")  # the second of charts alone


def render_page(page: HtmlPage, drawings: Mapping[str, bytes]) -> str:
    """A page as HTML.

    Args:
        page: Contents of the page.
        drawings: Its figures as PNG, by name; a figure without one is left out, and one for which there is no room is said to
            be.

    Raises:
        ValueError: A drawing is no PNG.
    """
    with_drawings = HtmlPage(page.title, page.subtitle, tuple(s.with_pictures(drawings) for s in page.sections))
    pieces = _assemble(with_drawings).split(_MARK)
    room = MOST_BYTES - sum(len(piece.encode()) for piece in pieces)
    for i, picture in enumerate(with_drawings.pictures):
        image = "" if picture.alone else _image_tag(drawings[picture.name], picture.title)
        room -= len(image)
        pieces[2 * i + 1] = image if room > 0 else TOO_LARGE
    return "".join(pieces)


def render_section(section: PageSection, addresses: Mapping[str, str]) -> str:
    """One section as HTML, for a page that somebody else makes with `page_assets`.

    Args:
        section: Section to render.
        addresses: Where its drawings are, by name; a figure without is left out, unless it is charts alone.
    """
    shown_section = section.with_pictures(addresses)
    pieces = _render_body(_make_environment(), shown_section).split(_MARK)
    for i, picture in enumerate(shown_section.pictures):
        alt, source = escape(printable(picture.title)), escape(addresses.get(picture.name, ""))
        pieces[2 * i + 1] = f'<img class="wide" alt="{alt}" src="{source}" loading="lazy">' if source else ""
    return "".join(pieces)


def page_assets() -> tuple[str, str]:
    """Return style and script of pages with charts; `drawCharts()` draws those that were put on the page since."""
    return "\n".join(map(_read_text, _STYLES)), "\n".join(_load_scripts())


def page_policy(scripts: Sequence[str] | None = None) -> str:
    """Content security policy of a page: it requests nothing, and runs some scripts of ours alone.

    Args:
        scripts: The scripts; all that a page may have if omitted.
    """
    allowed = " ".join(f"'sha256-{_digest(script)}'" for script in (_load_scripts() if scripts is None else scripts))
    return (
        f"default-src 'none'; script-src {allowed or _NOTHING}; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; "
        "form-action 'none'"
    )


def _render_body(environment: Environment, section: PageSection) -> str:
    """A section, with marks about the places of its drawings."""
    return environment.from_string(_read_text(section.template)).render(section.context)


def _image_tag(png: bytes, title: str) -> str:
    """Return a PNG as an element that holds it, in the size in which it was drawn."""
    if not png.startswith(_PNG):
        raise ValueError("a figure is damaged: its file is no PNG")
    width, height = (round(pixels * _CSS_PIXELS) for pixels in struct.unpack_from(">2I", png, len(_PNG) + 8))
    kind = "wide" if width > _COLUMN else "narrow"
    alt, content = escape(printable(title)), base64.b64encode(png).decode()
    return f'<img class="{kind}" width="{width}" height="{height}" alt="{alt}" src="data:image/png;base64,{content}">'


def _assemble(page: HtmlPage) -> str:
    """The page with marks about the places of its drawings, one after the other."""
    environment = _make_environment()
    scripts = _load_scripts() if any(picture.charts for picture in page.pictures) else ()
    styles = _STYLES if scripts else _STYLES[:1]
    frame = environment.get_template("page.html")
    return frame.render(
        page=page,
        bodies=[Markup(_render_body(environment, section)) for section in page.sections],  # noqa: S704
        style=Markup("\n".join(map(_read_text, styles))),  # noqa: S704  (ours)
        scripts=[Markup(script) for script in scripts],  # noqa: S704  (ours)
        policy=Markup(page_policy(scripts)),  # noqa: S704  (ours)
    )


def _make_environment() -> Environment:
    """Templates in which everything is escaped, and nothing steers."""
    environment = Environment(
        autoescape=True, undefined=StrictUndefined, finalize=_make_safe, loader=FileSystemLoader(_HERE), trim_blocks=True,
        lstrip_blocks=True,
    )  # fmt: skip

    def charts(picture: Picture) -> Markup:
        return htmlsafe_json_dumps([chart.to_json() for chart in picture.charts], separators=(",", ":"))

    environment.globals |= {"charts": charts, "place": Markup(f"{_MARK}{_MARK}")}  # noqa: S704  (ours)
    return environment


def _make_safe(value: Any) -> Any:
    """Text without what turns its direction or cannot be seen, numbers beside their units; markup is left as it is."""
    return unbroken(printable(value)) if type(value) is str else value


def _load_scripts() -> tuple[str, str]:
    """UPlot with its license, and what draws charts with it."""
    library, terms = _read_text(_HERE / "uplot" / "uPlot.iife.min.js"), _read_text(_HERE / "uplot" / "LICENSE")
    return f"/*\n{terms}\n*/\n{library}", _read_text(_HERE / "charts.js")


def _digest(script: str) -> str:
    return base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()


def _read_text(path: Path) -> str:
    return path.read_text(encoding="utf-8")
