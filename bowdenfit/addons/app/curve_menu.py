"""The menu of curve families, each with a small picture of what it can look like."""

from collections.abc import Callable, Collection, Mapping, Sequence
from functools import cache
from types import MappingProxyType
from typing import Any

import numpy as np
from nicegui import ui

from bowdenfit.addons.app.elements import block, markup, text
from bowdenfit.addons.app.workbench import Workbench
from bowdenfit.cable.registry import CURVES, load_class
from bowdenfit.description import Route
from bowdenfit.questions.start.cable_layout import CURVE_SHAPES

_WIDTH, _HEIGHT, _EDGE, _POINTS = 72, 40, 3, 41  # of a picture, in its own units
_VALUE = "event => emit(event.target.value)"


@cache
def draw_curve_pictures() -> Mapping[str, str]:
    """Return an SVG of each family that has an example, as its own formula gives it; loads JAX."""
    route, pictures = Route(variable="length", unit="mm", range=(-1.0, 1.0)), dict[str, str]()
    lengths = np.linspace(-1, 1, _POINTS)
    for name, family in CURVES.items():
        curve = load_class(family.place)("angle", route)
        if curve.example:
            pictures[name] = _draw(lengths, np.asarray(curve.at(lengths, *curve.example), dtype=float))
    return MappingProxyType(pictures)


def _draw(length: np.ndarray, angle: np.ndarray) -> str:
    """Return a line above an axis."""
    across = _EDGE + (length + 1) / 2 * (_WIDTH - 2 * _EDGE)
    up = _HEIGHT - _EDGE - angle / angle.max() * (_HEIGHT - 2 * _EDGE)
    points = " ".join(f"{x:.1f},{y:.1f}" for x, y in zip(across, up, strict=True))
    axes = f'<path d="M{_EDGE} {_EDGE}V{_HEIGHT - _EDGE}H{_WIDTH - _EDGE}"/>'
    return f'<svg viewBox="0 0 {_WIDTH} {_HEIGHT}" aria-hidden="true">{axes}<polyline points="{points}"/></svg>'


def is_of_curves(options: Collection[str]) -> bool:
    """Whether options are the families of curves."""
    return {*options} >= {*CURVES}


def show_curve_menu(
    workbench: Workbench, key: str, value: str, options: Sequence[tuple[str, str]], on_change: Callable[[str], Any], label: str
) -> None:
    """Show a menu of curve families with their pictures, which follow once they are drawn.

    Args:
        workbench: Which draws them.
        key: Key of the menu.
        value: What is chosen.
        options: Values with their words; a value that is no family has no picture.
        on_change: Called with what is chosen.
        label: What the menu is of.
    """
    places = {}
    with block("div", "curves", id=key, role="radiogroup", aria_label=label):
        for option, words in options:
            with block("label"):
                radio = block("input", "", type="radio", name=key, value=option, data_key=f"{key}-{option}")
                if option == value:
                    radio.props["checked"] = True
                radio.on("change", lambda event: on_change(str(event.args)), js_handler=_VALUE)
                places[option] = markup("", "span", "picture")
                with block("span"):
                    text(words, "span", "name")
                    if shape := CURVE_SHAPES.get(option, ""):
                        text(shape, "span", "hint")

    async def draw() -> None:
        for option, picture in (await workbench.compute(draw_curve_pictures)).items():
            if option in places:
                places[option].set_content(picture)

    ui.timer(0.05, draw, once=True)
