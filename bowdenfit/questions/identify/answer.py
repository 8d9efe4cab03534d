"""What the measurements of a cable determine, before any force is measured and after a fit, in words; loads no model."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

from bowdenfit.display import Display, Named, Rows
from bowdenfit.inference.identifiability import Combination, CovarianceAnalysis, ParameterContraction
from bowdenfit.results.serialization import values_by_key
from bowdenfit.words import decimals, listed, significant

if TYPE_CHECKING:
    from bowdenfit.inference.profiles import Profile

# Parameters that friction is made of, and those of the rope's elasticity: each group is judged by itself.
CURVES = "wrap angle curves"
GROUPS: Mapping[str, tuple[str, ...]] = {
    "friction": ("friction", "friction_model", "sensor", "angle"),
    "elastic": ("elastic",),
    CURVES: ("curve",),
}
_REMEDY = (
    "Coefficients rub at the same time, so only their weighted sum is seen; they come apart where the wrap angles change in "
    "different proportions: measure at lengths (or routes) where one contact turns much more than the others, or measure one "
    "coefficient separately and state it under [friction.NAME] as measured."
)


@dataclass(frozen=True, repr=False)
class Identifiability(Display):
    """What is known of the parameters of a cable, by group.

    Args:
        name: Name of the cable.
        basis: Where it was judged, in words.
        measured: Whether readings entered, or only the plan of what to measure.
        groups: Knowledge by group of `GROUPS`, as far as there are such parameters.
        profiles: How the sum of squares of the readings rises with each friction coefficient, the others fitted again.
        units: Of the parameters.
        meanings: What they are, in words.
    """

    name: str
    basis: str
    measured: bool
    groups: dict[str, CovarianceAnalysis]
    profiles: "tuple[Profile, ...]" = ()
    units: Mapping[str, str] = field(default_factory=dict)
    meanings: Mapping[str, str] = field(default_factory=dict)

    JSON: ClassVar = ("name", "basis", "sentences", "groups", ("profiles", "rises"))

    def sentences(self) -> list[str]:
        """What is known, in words: friction first, and a remedy where something is not."""
        friction, elastic = (self.groups.get(group) for group in ("friction", "elastic"))
        said = [say_what_is_determined(friction, self.measured)] if friction else []
        if elastic is not None:
            said.append(say_what_is_determined(elastic, self.measured, "Of how the cable gives they determine"))
        if friction is not None and (friction.undetermined or friction.determined):
            said.append(_REMEDY)
        return said

    def _table(self) -> Rows:
        rows = [
            {"parameter": p.name, "group": name} | values_by_key(p)
            for name, group in self.groups.items()
            for p in group.parameters
        ]
        return [{key: value for key, value in row.items() if key != "name"} for row in rows], self.units

    @property
    def rises(self) -> Named[Any]:
        """Profiles by the name of their coefficient."""
        return Named({p.name: Named({"value": p.values, "rise": p.rise}) for p in self.profiles})


def say_what_is_determined(found: CovarianceAnalysis, measured: bool, opening: str = "") -> str:
    """What some parameters are known to, in one sentence.

    Args:
        found: What is known.
        measured: Whether readings entered.
        opening: How the sentence begins.
    """
    opening = opening or ("These measurements determine" if measured else "Measurements by this plan would determine")
    parts = [f"{p.name} {how_well(p)}" for p in found.identified]
    parts += [f"{c.words} {how_well(c)}" for c in found.determined]
    said = f"{opening} {listed(parts)}" if parts else f"{opening} no coefficient by itself"
    resting, half = found.resting, found.partly_identified
    if half:
        verb = "owes" if len(half) == 1 else "owe"
        said += f"; {listed([p.name for p in half])} {verb} about as much to the prior as to them"
    if resting:
        verb = "rests on its prior" if len(resting) == 1 else "rest on their priors"
        said += f"; {listed(resting)} {verb}"
    if found.sharpest is not None and not found.determined:
        said += f"; sharpest of all is {found.sharpest.words}, {how_well(found.sharpest)}"
    return said + "."


def how_well(known: ParameterContraction | Combination) -> str:
    """How well a quantity is known: in percent where it is clear of zero, else in its unit."""
    if abs(known.value) > 2 * known.sd:
        return f"to {significant(100 * known.sd / abs(known.value), 2)} %"
    return f"to ± {known.sd:z.{decimals(known.sd)}f}"
