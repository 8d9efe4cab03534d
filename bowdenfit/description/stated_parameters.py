"""What a description states of parameters: of stretch and preload, and which sizes of a parameter are possible."""

from collections.abc import Mapping
from typing import Literal

from bowdenfit.description.values import Frozen, ParameterSetting, QuantityValue
from bowdenfit.errors import DescriptionError

PRELOAD = "preload"

LOWEST = {"stiffness": False, "bedding_load": False, "bedding_stretch": True, "lengthening": True, PRELOAD: True}
"""Elastic parameters that cannot be negative, and whether they can be 0."""

RUN_SCATTER, GAIN_ERROR = "tau", "gain_error"
_OF_WHAT = {
    RUN_SCATTER: "how much mountings of one cable differ",
    GAIN_ERROR: "how much the load cells differ",
}
_MOST = 1.0  # judged: a factor of e between two mountings or two cells


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
    """Refuse preload that is stated twice, and elastic parameters that are fixed at impossible values."""
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


def check_shares(prior: Mapping[str, ParameterSetting], file: str) -> None:
    """Refuse shares of a size that only a number of per cent has.

    Raises:
        DescriptionError: One is, or is expected to be.
    """
    for name in (name for name in _OF_WHAT if name in prior):
        key, size = _size(prior[name])
        if size >= _MOST:
            raise DescriptionError(
                f"{file}, prior.{name}.{key}: {size:g} would be {100 * size:g} %, and {_OF_WHAT[name]} is a few per cent; it "
                f"is stated as a fraction, so write {size / 100:g} for {size:g} %."
            )


def _size(setting: ParameterSetting) -> tuple[str, float]:
    """Return the largest number that says how large a parameter is, with its key."""
    if setting.fixed is not None:
        return "fixed", abs(setting.fixed)
    if setting.measured is not None:
        return "measured", max(setting.measured.value, setting.measured.sd)
    stated = setting.prior.model_dump(exclude_none=True) if setting.prior is not None else {}
    sizes = {
        f"prior.{kind}.{key}": abs(value)
        for kind, numbers in stated.items()
        for key, value in numbers.items()
        if key in ("median", "mean", "sd", "scale")
    }
    return max(sizes.items(), key=lambda item: item[1], default=("prior", 0.0))
