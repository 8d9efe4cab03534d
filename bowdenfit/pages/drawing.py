"""A drawing (SVG) as part of a page: nothing in it acts, is fetched, or bears the name of something elsewhere on the page."""

import re
from html import escape
from xml.etree import ElementTree

from bowdenfit.words import printable

_TAGS = {
    "clipPath", "defs", "ellipse", "circle", "g", "image", "line", "linearGradient", "path", "pattern", "polygon", "polyline",
    "rect", "stop", "text", "tspan", "use",
}  # fmt: skip
_SHAPES = ("d", "x", "y", "x1", "y1", "x2", "y2", "cx", "cy", "r", "rx", "ry", "width", "height", "points", "dx", "dy")
_ATTRIBUTES = {
    *_SHAPES, "clip-path", "fill", "fill-opacity", "gradientUnits", "id", "offset", "opacity", "patternUnits", "stop-color",
    "stroke", "style", "transform", "viewBox", "xml:space",
}  # fmt: skip
_XLINK, _XML = "{http://www.w3.org/1999/xlink}href", "{http://www.w3.org/XML/1998/namespace}space"
_LONG = re.compile(r"-?\d+\.\d{3,}")  # more decimals than a printer has points
_REFERRED = re.compile(r"url\(#([^)]+)\)")
_FOREIGN = re.compile(r"url\(\s*['\"]?(?!#)|@import|expression|javascript:|\\", re.IGNORECASE)
_FONT = re.compile(r"'DejaVu Sans'[^;\"]*sans-serif")  # a list as long as the word, at every word
_PICTURE = "data:image/png;base64,"


def inline(svg: str, prefix: str, words: str) -> str:
    """The drawing as HTML: what draws is kept, with names of its own; what acts, loads or links elsewhere is left out.

    Args:
        svg: A whole file.
        prefix: Of its names, which no other drawing of the page has.
        words: What it shows, for those who do not see it.

    Raises:
        ValueError: It is no SVG.
    """
    try:
        root = ElementTree.fromstring(svg)  # noqa: S314  (of this fit; a parser that expands nothing without bounds)
    except ElementTree.ParseError as error:
        raise ValueError(f"a drawing is damaged ({error})") from None
    names = {name: f"{prefix}{i}" for i, name in enumerate(dict.fromkeys(_referred(root)))}
    view, width = root.get("viewBox", ""), root.get("width", "")
    size = f' width="{escape(width)}"' if re.fullmatch(r"[\d.]+pt", width) else ""
    start = f'<svg role="img" aria-label="{escape(printable(words))}" viewBox="{escape(view)}"{size}>'
    return start + "".join(_element(child, names) for child in root) + "</svg>"


def _referred(root: ElementTree.Element) -> list[str]:
    """Names that something in the drawing refers to."""
    found = list[str]()
    for element in root.iter():
        for key, value in element.attrib.items():
            found += [value[1:]] if key == _XLINK and value.startswith("#") else _REFERRED.findall(value)
    return found


def _element(element: ElementTree.Element, names: dict[str, str]) -> str:
    """One element with what is in it; empty of kinds that do not draw."""
    tag = element.tag.rpartition("}")[2] if isinstance(element.tag, str) else ""
    if tag not in _TAGS:
        return ""
    inside = escape(printable((element.text or "").strip("\n"))) if tag in ("text", "tspan") else ""
    inside += "".join(_element(child, names) for child in element)
    attributes = "".join(_attribute(key, value, names) for key, value in element.attrib.items())
    if not inside and tag in ("g", "defs"):
        return ""
    if tag == "g" and not attributes:
        return inside
    return f"<{tag}{attributes}>{inside}</{tag}>" if inside else f"<{tag}{attributes}/>"


def _attribute(key: str, value: str, names: dict[str, str]) -> str:
    if key == _XLINK:
        target = f"#{names[value[1:]]}" if value.startswith("#") else value if value.startswith(_PICTURE) else None
        return f' href="{escape("".join(target.split()))}"' if target else ""
    key = "xml:space" if key == _XML else key
    if key not in _ATTRIBUTES or _FOREIGN.search(value) or (key == "id" and value not in names):
        return ""
    value = names[value] if key == "id" else _REFERRED.sub(lambda found: f"url(#{names[found[1]]})", value)
    if key in _SHAPES:
        value = " ".join(_LONG.sub(lambda number: f"{float(number[0]):.2f}".rstrip("0").rstrip("."), value).split())
    elif key == "style":
        value = _FONT.sub("var(--letters)", value).replace(": ", ":").replace("; ", ";")
    return f' {key}="{escape(value)}"'
