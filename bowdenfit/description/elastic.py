"""What a description says of the stretch and of the preload of a cable."""

from collections.abc import Mapping
from typing import Literal

from bowdenfit.description.values import Frozen, ParameterSetting, QuantityValue
from bowdenfit.errors import DescriptionError

PRELOAD = "preload"
LOWEST = {"stiffness": False, "bedding_load": False, "bedding_stretch": True, "lengthening": True, PRELOAD: True}
"""Elastic parameters that cannot be negative, and whether they can be 0."""


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
