"""What a description says of a cable's kind and sizes."""

from typing import Literal

from bowdenfit.description.pulleys import Pulleys
from bowdenfit.description.values import Frozen, QuantityValue

LEAST_BEND_RATIO = 20.0  # rope diameters; haptic paper, equation 2


class CableSettings(Frozen):
    """What kind of cable it is: one rope, or a pull-pull loop of two; radii of the pulleys; sizes to check."""

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
