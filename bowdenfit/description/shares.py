"""Parameters that are shares, printed in per cent and stated as fractions."""

from collections.abc import Mapping

from bowdenfit.description.values import ParameterSetting
from bowdenfit.errors import DescriptionError

RUN_SCATTER, GAIN_ERROR = "tau", "gain_error"
_OF_WHAT = {
    RUN_SCATTER: "how much mountings of one cable differ",
    GAIN_ERROR: "how much the load cells differ",
}
_MOST = 1.0  # a factor of e between two mountings or two cells


def check_shares(prior: Mapping[str, ParameterSetting], file: str) -> None:
    """No share is of a size that only a number of per cent has.

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
    """The largest number that says how large a parameter is, with its key."""
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
