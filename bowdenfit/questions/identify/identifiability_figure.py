"""What measurements determine: each parameter's share of measurements and prior, and the combinations that are known."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.layout import empty_page, text_width, ticks, wrap_words
from bowdenfit.plots.style import BLUE, GRAY, LEAST, LIGHT, SMALL, WIDE, in_paper_style
from bowdenfit.questions.identify.likelihood_figure import HIGHEST_RISE, LEVEL_OF_ONE
from bowdenfit.words import counted

if TYPE_CHECKING:
    from bowdenfit.inference.identifiability import CovarianceAnalysis
    from bowdenfit.inference.profiles import Profile
    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.questions.identify.answer import Identifiability

HEADING = "What the measurements determine"
_ROW, _TOP, _BOTTOM, _NAMES, _GAP = 0.24, 0.34, 0.5, 1.75, 0.35  # in
_PROFILE, _PROFILES_IN_ROW = 1.75, 4  # height of a row of profiles [in], and how many are in it
_TICK_GAP = 0.08  # in, between numbers below a profile
_CELL = 0.24  # in, room that a number in the map takes
_SMALLEST_WEIGHT = 0.05  # weight below which a cell of the map is left empty


def caption(identifiability: Identifiability) -> str:
    """Describe what is drawn, in plain words."""
    n = sum(len(group.parameters) for group in identifiability.groups.values())
    text = (
        "Left: share of each parameter's prior variance that the measurements remove. "
        "Right: independent weighted sums of the parameters, the best known first, with the weight of each in units of "
        "its prior's standard deviation; below each how much of the sum's prior variance is left."
    )
    if identifiability.profiles:
        text += (
            " Below: rise of the sum of squares of the readings when one coefficient is moved and the others follow; where it "
            "crosses the dashed line, a 90 % interval ends, and where it stays flat, the readings say nothing."
        )
    return f"{text} Judged at {identifiability.basis}; n = {counted(n, 'parameter')}."


@in_paper_style
def draw(identifiability: Identifiability) -> Figure:
    """Draw a row of panels for each group of parameters: prior shares, and the combinations that are determined.

    Profiles of the friction coefficients are a last row of panels.
    """
    groups, profiles = identifiability.groups, identifiability.profiles
    heights = [_ROW * len(group.parameters) + _TOP + _BOTTOM for group in groups.values()]
    rows = -(-len(profiles) // _PROFILES_IN_ROW)
    total = sum(heights) + rows * _PROFILE
    figure = empty_page(WIDE, total)
    width, top = (WIDE - _NAMES - _GAP - 0.15) / 2, total
    for (name, group), height in zip(groups.items(), heights, strict=True):
        bottom, tall = (top - height + _BOTTOM) / total, (height - _TOP - _BOTTOM) / total
        left = figure.add_axes((_NAMES / WIDE, bottom, width / WIDE, tall))
        _draw_shares(left, name, group)
        if len(group.parameters) > 1:
            _draw_combinations(figure.add_axes(((_NAMES + width + _GAP) / WIDE, bottom, width / WIDE, tall)), group)
        top -= height
    for i, profile in enumerate(profiles):
        bottom = top - _PROFILE * (i // _PROFILES_IN_ROW + 1) + _BOTTOM
        across = (WIDE - 0.5) / _PROFILES_IN_ROW
        box = (0.6 + across * (i % _PROFILES_IN_ROW), bottom, across - 0.45, _PROFILE - _BOTTOM - _TOP)
        _draw_profile(figure.add_axes((box[0] / WIDE, box[1] / total, box[2] / WIDE, box[3] / total)), profile, i == 0)
    return figure


def _draw_profile(axes: Axes, profile: Profile, first: bool) -> None:
    """Draw the rise of the sum of squares; where it stays flat the readings say nothing."""
    axes.plot(profile.values, profile.rise, color=BLUE)
    axes.axhline(LEVEL_OF_ONE, color=GRAY, linestyle="--", linewidth=0.8)
    axes.set_ylim(-0.5, HIGHEST_RISE)
    axes.set_xlabel(_shorten_name(profile.name, (WIDE - 0.5) / _PROFILES_IN_ROW, 8))
    width = axes.get_position().width * WIDE
    axes.set_xticks(*ticks(axes.get_xlim(), lambda texts: width / (max(map(text_width, texts)) + _TICK_GAP)))
    if first:
        axes.set_title("Sum of squares of the readings above its minimum (dashed: 90 % limit)", loc="left")
        axes.set_ylabel("Rise")


def _draw_shares(axes: Axes, name: str, group: CovarianceAnalysis) -> None:
    """Draw the shares of prior and measurements in what is known of each parameter."""
    names = [p.name for p in group.parameters]
    percent = np.array([100 * max(p.contraction, 0.0) for p in group.parameters])
    rows = np.arange(len(names))
    axes.barh(rows, percent, color=BLUE, height=0.62)
    axes.barh(rows, 100 - percent, left=percent, color=LIGHT, height=0.62)
    axes.set_yticks(rows, [_shorten_name(name, _NAMES - 0.2) for name in names])
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.set_xlim(0, 100)
    axes.grid(visible=False)
    axes.set_title(name[0].upper() + name[1:], loc="left")
    axes.set_xlabel("Determined by the measurements, not the prior (%)")


def _draw_combinations(axes: Axes, group: CovarianceAnalysis) -> None:
    """Draw a map of the weights, in units of the priors' standard deviations; columns are combinations."""
    names, prior_sd = [p.name for p in group.parameters], {p.name: p.prior_sd for p in group.parameters}
    weights = np.array([[d.weights.get(n, 0.0) * prior_sd[n] for n in names] for d in group.directions]).T
    weights = weights / np.maximum(np.sqrt(np.sum(weights**2, axis=0)), 1e-300)
    axes.imshow(weights, cmap="RdBu_r", vmin=-1, vmax=1, aspect="auto")
    room = axes.get_position().width * WIDE / len(group.directions)
    for (row, column), weight in np.ndenumerate(weights):
        if abs(weight) > _SMALLEST_WEIGHT and room > _CELL:
            dark = abs(weight) > 0.6
            axes.text(
                column,
                row,
                f"{weight:+.1f}",
                ha="center",
                va="center",
                fontsize=SMALL - 1,
                color="white" if dark else "black",
            )
    axes.set_yticks([])
    labels = [_format_share(d.share) for d in group.directions]
    slanted = max(map(text_width, labels)) + 0.04 > room
    axes.set_xticks(np.arange(len(labels)), labels, rotation=90 if slanted else 0, fontsize=LEAST if slanted else SMALL)
    axes.tick_params(length=0)
    axes.grid(visible=False)
    axes.set_title("Combinations, the best known first", loc="left")
    axes.set_xlabel("Left of the prior variance (%)")


def _shorten_name(name: str, room: float, size: float = SMALL) -> str:
    """Return a parameter's name as words, its end left out where there is no room for it [in]."""
    return wrap_words(name.replace("_", " "), room, size, most=1)


def _format_share(share: float) -> str:
    """Format a share in percent."""
    percent = 100 * share
    return f"{percent:.0f}" if percent >= 9.5 else f"{percent:.1f}" if percent >= 0.095 else "<0.1"
