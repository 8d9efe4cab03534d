"""What pages are made of: plain elements of HTML with labels, in the look of the report."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from html import escape
from pathlib import Path
from typing import Any
from urllib.parse import quote, urlencode

from nicegui import ui
from nicegui.element import Element

from bowdenfit.addons.app.page_words import page_words
from bowdenfit.words import printable, unbroken

BENCH = (Path(__file__).parent / "bench.svg").read_text(encoding="utf-8")
_VALUE = "event => emit(event.target.value)"
VALUE_AT_FIRST = "^value"  # set as an attribute: the property would be set back, over what is typed, whenever the page changes


def address(*parts: str, **query: str) -> str:
    """Address of a page or a file of the app, in which names are percent-encoded.

    Args:
        parts: Its parts, such as "fit" and the name of one.
        query: Text after the question mark.
    """
    path = "/" + "/".join(quote(part, safe="") for part in parts)
    return f"{path}?{urlencode(query, quote_via=quote)}" if query else path


def session_root() -> str:
    """What every address begins with in the browser that a page is made for (see `guard.py`)."""
    request = ui.context.client.request
    return str(request.scope["root_path"]) if request is not None else ""


def text(words: str, tag: str = "p", classes: str = "", **attributes: str) -> ui.html:
    """Return an element with text in it, in which names stay text."""
    return markup(escape(unbroken(printable(words))), tag, classes, **attributes)


def markup(html: str, tag: str = "div", classes: str = "", **attributes: str) -> ui.html:
    """Return an element with HTML of ours in it."""
    made = ui.html(html, sanitize=False, tag=tag)
    _set_attributes(made, classes, attributes)
    return made


def block(tag: str = "div", classes: str = "", **attributes: str) -> Element:
    """Return an element that others go into."""
    made = ui.element(tag)
    _set_attributes(made, classes, attributes)
    return made


def _set_attributes(element: Element, classes: str, attributes: Mapping[str, str]) -> None:
    element.classes(classes)
    for name, value in attributes.items():
        element.props[name.rstrip("_").replace("_", "-")] = value


def report(printed: str) -> ui.html:
    """Return an element with what a command reports, line by line, in the words of a page."""
    return text(page_words(printed), "pre", tabindex="0")


def button(words: str, on_click: Callable[..., Any], classes: str = "", key: str = "", **attributes: str) -> Element:
    """Return a button."""
    made = text(words, "button", classes, type="button", data_key=key or words, **attributes)
    return made.on("click", on_click, args=[])


def link(words: str, target: str, classes: str = "", **attributes: str) -> Element:
    """Return a link.

    Args:
        words: Its text.
        target: An `address`, or a place on the page.
        classes, attributes: Of the element.
    """
    root = session_root() if target.startswith("/") else ""
    return text(words, "a", classes, href=f"{root}{target}", data_key=target, **attributes)


@contextmanager
def field(label: str, key: str, hint: str = "", fault: str = "") -> Iterator[None]:
    """Put a control below its label; what is below it describes it, also to those who do not see it.

    Args:
        label: Label of the field.
        key: Key of the control.
        hint: Below it.
        fault: Why what it holds cannot be taken.
    """
    with block("div", "field"):
        text(label, "label", for_=key)
        with block("div") as slot:
            yield
        if fault:
            text(page_words(fault), "p", "fault", id=f"{key}-fault", role="alert")
        if hint:
            text(page_words(hint), "p", "hint", id=f"{key}-hint")
    described = [f"{key}-{part}" for part, words in (("fault", fault), ("hint", hint)) if words]
    for control in slot.descendants():
        if described and control.props.get("id") == key:
            control.props["aria-describedby"] = " ".join(described)
            control.props["aria-invalid"] = str(bool(fault)).lower()


def text_input(key: str, value: str, on_change: Callable[[str], Any], placeholder: str = "", label: str = "") -> Element:
    """Return a line of text that is asked for; told when it is left, or at Enter."""
    made = block("input", "", id=key, type="text", data_key=key, autocomplete="off", placeholder=placeholder)
    made.props[VALUE_AT_FIRST] = value
    if label:
        made.props["aria-label"] = label
    return made.on("change", lambda event: on_change(str(event.args)), js_handler=_VALUE)


def choice(
    key: str, value: str, options: Sequence[tuple[str, str]], on_change: Callable[[str], Any], label: str = ""
) -> Element:
    """Return a menu.

    Args:
        key: Key of the control.
        value: Chosen value.
        options: Values with their words.
        on_change: Called with what is chosen.
        label: What it is of, where no label stands beside it.
    """
    made = block("select", "", id=key, data_key=key)
    if label:
        made.props["aria-label"] = label
    with made:
        for option, words in options:
            item = text(words, "option", value=option)
            if option == value:
                item.props["selected"] = True
    return made.on("change", lambda event: on_change(str(event.args)), js_handler=_VALUE)
