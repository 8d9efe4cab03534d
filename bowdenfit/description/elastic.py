"""What a description says of a cable's kind and sizes, of its stretch and of its preload."""

from collections.abc import Mapping
from typing import Literal

from bowdenfit.description.pulleys import Pulleys
from bowdenfit.description.values import Frozen, ParameterSetting, QuantityValue
from bowdenfit.errors import DescriptionError

PRELOAD = "preload"
LOWEST = {"stiffness": False, "bedding_load": False, "bedding_stretch": True, "lengthening": True, PRELOAD: True}
"""Elastic parameters that cannot be negative, and whether they can be 0."""
LEAST_BEND_RATIO = 20.0  # rope diameters; haptic paper, equation 2


class CableSettings(Frozen):
    """What kind of cable it is: one rope, or a pull-pull loop of two; radii of the loop's pulleys; sizes to check."""

    kind: Literal["single", "loop"] = "single"
    input_pulley_radius: QuantityValue | None = None
    output_pulley_radius: QuantityValue | None = None
    rope_diameter: QuantityValue | None = None
    bend_radius: QuantityValue | None = None
    backlash: QuantityValue | None = None

    @property
    def pulleys(self) -> Pulleys:
        """Radii of the pulleys in mm."""
        stated = self.input_pulley_radius, self.output_pulley_radius
        return Pulleys(*(None if radius is None else radius.to("length") for radius in stated))

    @property
    def lengths(self) -> dict[str, QuantityValue | None]:
        """All its lengths by name."""
        return {name: getattr(self, name) for name in type(self).model_fields if name != "kind"}

    @property
    def sharp_bend(self) -> str:
        """A warning where the rope is bent more sharply than its makers recommend; empty otherwise."""
        if self.rope_diameter is None or self.bend_radius is None:
            return ""
        ratio = self.bend_radius.to("length") / self.rope_diameter.to("length")
        if ratio >= LEAST_BEND_RATIO:
            return ""
        return (
            f"the smallest bend radius is {ratio:.3g} rope diameters; makers recommend at least {LEAST_BEND_RATIO:g}, because "
            "a rope that is bent more sharply wears, and its friction grows with time."
        )


class StretchSettings(Frozen):
    """The coefficient of friction that acts while the rope is stretched; one of its own if none is named."""

    friction: str | None = None


class PreloadSettings(Frozen):
    """How preload depends on the wrap angle: constant by springs, or as the stretch of the rope between fixed ends has it.

    Without a word it follows the stretch where a table of preload is given, and is constant elsewhere. The parameter
    `preload` is its value, at `wrap_angle` where it depends on that; free if no value is stated.
    """

    model: Literal["constant", "stretch"] | None = None
    wrap_angle: QuantityValue = QuantityValue(value=0.0, unit="deg")
    value: QuantityValue | None = None


def check_elastic(preload: PreloadSettings, prior: Mapping[str, ParameterSetting], file: str) -> None:
    """Preload is stated once, and no elastic parameter is fixed where it cannot be."""
    if preload.value is not None and PRELOAD in prior:
        raise DescriptionError(
            f"{file} states the preload twice, as value under [preload] and under [prior.{PRELOAD}]; leave one of them out."
        )
    for name, setting in prior.items():
        if name not in LOWEST or setting.fixed is None:
            continue
        if setting.fixed < 0 or (setting.fixed == 0 and not LOWEST[name]):
            least = "0 or more" if LOWEST[name] else "more than 0"
            raise DescriptionError(
                f"{file}, prior.{name}.fixed: {setting.fixed:g} is not possible; it must be {least}."
            )
