"""Several fits of the same measurements side by side."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from bowdenfit.errors import UsageError
from bowdenfit.inference.comparison import Difference, differences, left_out
from bowdenfit.results.answers import Interval
from bowdenfit.results.fit import Fit
from bowdenfit.results.rate import RateEffect, rate_effect

_SHOWN_ROLES = {"friction", "friction_model", "sensor"}


@dataclass(frozen=True)
class Comparison:
    """What sets several fits apart.

    Args:
        differences: How well each predicts readings left out, the best first.
        described: What each assumes, in words.
        parameters: Coefficients and the like, by parameter and fit.
        optimal_length: Of each fit with a route, with its unit.
        rate_effects: Of the fits in which friction may depend on speed.
    """

    differences: dict[str, Difference]
    described: dict[str, str]
    parameters: dict[str, dict[str, Interval]]
    optimal_length: dict[str, tuple[Interval, str]]
    rate_effects: dict[str, RateEffect]

    def page(self) -> dict[str, Any]:
        """The same as plain data."""
        return {
            "fits": [
                {
                    "name": name,
                    "model": self.described[name],
                    "elpd_difference": d.elpd,
                    "standard_error": d.standard_error,
                    "unreliable_readings": d.unreliable,
                }
                for name, d in self.differences.items()
            ],
            "parameters": {p: {name: asdict(i) for name, i in row.items()} for p, row in self.parameters.items()},
            "optimal_length": {name: asdict(i) | {"unit": unit} for name, (i, unit) in self.optimal_length.items()},
            "rate_effect": {name: asdict(effect) for name, effect in self.rate_effects.items()},
        }


def compare(fits: Mapping[str, Fit]) -> Comparison:
    """Compare fits.

    Args:
        fits: By name.

    Raises:
        UsageError: There are fewer than two, one has no posterior, or they are not of the same readings.
    """
    if len(fits) < 2:
        raise UsageError("a comparison needs at least two fits; name their results folders.")
    readings = {name: _readings(name, fit) for name, fit in fits.items()}
    first, *others = readings
    for name in others:
        if readings[name] != readings[first]:
            raise UsageError(
                f"{first} and {name} were not fitted to the same readings, so how well they predict them cannot be compared; "
                "fit the same data set twice, such as with and without --friction rate-dependent."
            )
    predictions = {name: left_out(_drawn(name, fit).log_likelihood, _effective(fit)) for name, fit in fits.items()}
    order = differences(predictions)
    ordered = {name: fits[name] for name in order}
    effects = {name: effect for name, fit in ordered.items() if (effect := rate_effect(fit)) is not None}
    return Comparison(
        order,
        {name: _described(fit) for name, fit in ordered.items()},
        _parameters(ordered),
        {
            n: (f.optimal_length().length, f.dataset.description.route.unit)
            for n, f in ordered.items()
            if f.dataset.description.route
        },
        effects,
    )


def _drawn(name: str, fit: Fit) -> Any:
    if fit.posterior is None:
        raise UsageError(f"{name} has no posterior, because it was made without MCMC; fit it again without --no-mcmc.")
    return fit.posterior


def _readings(name: str, fit: Fit) -> Any:
    """What a fit was fitted to, so that two can be told to be of the same: values and labels of every reading."""
    _drawn(name, fit)
    angles = fit.dataset.description.tables.angles
    table = fit.dataset.description.tables.recordings
    how = (angles.undetected if angles else None, fit.dataset.description.geometry, table.likelihood if table else None)
    inputs = tuple(sorted((file, digest) for file, digest in fit.dataset.sha256.items() if not file.endswith(".toml")))
    return how[0], how[2], inputs, tuple((t.name, t.labels) for t in fit.model.terms)


def _effective(fit: Fit) -> float:
    """Effective number of draws: the smallest of any quantity."""
    assert fit.posterior is not None  # checked by the caller
    return min((d.ess_bulk for d in fit.posterior.diagnostics.values()), default=float(fit.posterior.z[..., 0].size))


def _described(fit: Fit) -> str:
    """What sets a fit apart from others of the same data."""
    description = fit.dataset.description
    parts = [description.friction_model]
    if description.curved:
        parts.append(f"{description.geometry} geometry")
    fixed = [p.name for p in fit.model.space.fixed]
    return ", ".join(parts + ([f"{', '.join(fixed)} fixed"] if fixed else []))


def _parameters(fits: Mapping[str, Fit]) -> dict[str, dict[str, Interval]]:
    rows: dict[str, dict[str, Interval]] = {}
    for name, fit in fits.items():
        for p in fit.model.space.free:
            if p.role in _SHOWN_ROLES and fit.posterior is not None:
                rows.setdefault(p.name, {})[name] = Interval.of(np.asarray(fit.posterior.values[p.name]))
    return rows
