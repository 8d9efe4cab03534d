"""Contrasts between groups of readings: by how much the friction of a new rope differs from that of an old one."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any, ClassVar

import numpy as np

from bowdenfit.cable.registry import coefficient_of
from bowdenfit.display import Display, Rows
from bowdenfit.inference.interval import Interval
from bowdenfit.results.record import Record, cached_per_fit
from bowdenfit.words import decimals, filled, listed

_ALL_PAIRS = 4  # groups, of which each is compared with each; of more, all with the first; a judgement
_SURE = 0.999  # beyond which draws are too few to say more


@dataclass(frozen=True, repr=False)
class Contrast(Display):
    """Difference of a friction coefficient between two groups.

    Args:
        coefficient: Which coefficient.
        group, less: The groups.
        difference: Difference of the draws, a new mounting of the cable not in it: what the groups do on average.
        probability: That it has the sign of its median, whichever that is: 0.5 where nothing is known of it.
    """

    coefficient: str
    group: str
    less: str
    difference: Interval
    probability: float

    JSON: ClassVar = (..., ("in_words", "sentence"))

    def sentence(self) -> str:
        """Return the contrast in words: "new less old: -0.140, 90 % interval -0.160 to -0.120, different (lower) with ..."."""
        difference, direction = self.difference, "lower" if self.difference.median < 0 else "higher"
        value, low, high = (
            f"{v:z.{decimals(difference.sd)}f}" for v in (difference.median, difference.q05, difference.q95)
        )
        certainty = f"above {_SURE}" if self.probability > _SURE else f"{self.probability:.3g}"
        return (
            f"{self.group} minus {self.less}: {value}, 90 % interval {low} to {high}, different ({direction}) with "
            f"probability {certainty}"
        )

    def __str__(self) -> str:
        return self.sentence()

    def sentences(self) -> list[str]:
        """Return the contrast in words."""
        return [self.sentence()]

    def _table(self) -> Rows:
        return [self.row], dict.fromkeys(self.row, "1")

    @property
    def row(self) -> dict[str, Any]:
        """Its row of a table."""
        named = {"coefficient": self.coefficient, "group": self.group, "less": self.less}
        return named | vars(self.difference) | {"probability": self.probability}


@dataclass(frozen=True, repr=False)
class Groups(Display):
    """The groups of readings that have coefficients of their own.

    Args:
        names: In order.
        predicted: The one that predictions are for.
        contrasts: Between them.
    """

    names: tuple[str, ...]
    predicted: str
    contrasts: tuple[Contrast, ...]

    def sentences(self) -> list[str]:
        """Return the contrasts in words."""
        return [f"Friction {c.coefficient}, {c.sentence()}." for c in self.contrasts]

    def _table(self) -> Rows:
        rows = [contrast.row for contrast in self.contrasts]
        return rows, dict.fromkeys(rows[0] if rows else (), "1")

    def contrast(self, group: str, less: str, coefficient: str = "") -> Contrast:
        """Return one contrast, in either direction.

        Args:
            group: A group.
            less: The group that is taken off.
            coefficient: Which coefficient; the first if omitted.

        Raises:
            KeyError: There is none of these groups.
        """
        matching = [
            c for c in self.contrasts if coefficient in ("", c.coefficient) and {c.group, c.less} == {group, less}
        ]
        if not matching:
            raise KeyError(f"there is no contrast of {group!r} and {less!r}; groups are {', '.join(self.names)}.")
        contrast, difference = matching[0], matching[0].difference
        if contrast.group == group:
            return contrast
        other_way = Interval(-difference.mean, difference.sd, -difference.median, -difference.q95, -difference.q05)
        return replace(contrast, group=group, less=less, difference=other_way)


@cached_per_fit
def contrast_groups(fit: Record) -> Groups | None:
    """Return the groups of a fit and their contrasts; None if all readings share their coefficients, or without draws."""
    names = fit.model.cable.friction.groups
    if not names or fit.sampled is None:
        return None
    return Groups(names, names[0], tuple(_contrasts(fit, names)))


def _contrasts(fit: Record, names: tuple[str, ...]) -> Iterator[Contrast]:
    pairs = list(combinations(names, 2)) if len(names) <= _ALL_PAIRS else [(names[0], name) for name in names[1:]]
    contacts = fit.dataset.description.contact
    for coefficient in dict.fromkeys(c.friction for c in contacts if c.by_group):
        for group, less in pairs:
            draws = np.ravel(
                _draws(fit, coefficient_of(coefficient, group)) - _draws(fit, coefficient_of(coefficient, less))
            )
            below = float(np.mean(draws < 0))
            yield Contrast(coefficient, group, less, Interval.of(draws), max(below, 1 - below))


def _draws(fit: Record, name: str) -> np.ndarray | float:
    """Return the draws of a coefficient, or its fixed value."""
    values = fit.draws().values
    return values[name] if name in values else next(p.fixed or 0.0 for p in fit.model.space.fixed if p.name == name)


def groups_text(fit: Record) -> str:
    """Return the contrasts of a fit, a line each; empty without groups or draws."""
    groups = contrast_groups(fit)
    if groups is None:
        return ""
    several = len({c.coefficient for c in groups.contrasts}) > 1
    lines = [f"  {f'{c.coefficient}, ' if several else ''}{c.sentence()}" for c in groups.contrasts]
    what = listed(list(dict.fromkeys(c.coefficient for c in groups.contrasts)))
    note = (
        "The probability is that of the sign, which is 0.5 where nothing is known. "
        f"Efficiencies{' and the best length' if fit.dataset.description.route else ''} that name no group are of the group "
        f"{groups.predicted}; --set group=NAME asks for another."
    )
    return "\n".join([f"Friction of the groups, {what}", *lines, filled(note)])
