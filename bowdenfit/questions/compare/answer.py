"""Several fits of the same measurements side by side."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import jax
import numpy as np

from bowdenfit.cable.sensors import RUN_SCATTER
from bowdenfit.description import Description
from bowdenfit.display import Display, Rows
from bowdenfit.errors import UsageError
from bowdenfit.inference.comparison import ElpdDifference, LooPrediction, compare_predictions, stacking_weights
from bowdenfit.inference.interval import Interval
from bowdenfit.inference.leave_one_out import LooDensity, leave_one_out
from bowdenfit.inference.log_density import LogDensity as Density
from bowdenfit.kinds import find_readings
from bowdenfit.kinds.run_parts import LeaveOut, RunParts
from bowdenfit.kinds.terms import iterate_term_kinds
from bowdenfit.questions.compare.common_readings import (
    CommonReadings,
    OmittedReadings,
    choose_parts,
    find_common_readings,
)
from bowdenfit.questions.error_budget import find_optimal_length
from bowdenfit.questions.recorded.friction_effects import RateEffect, compare_speeds
from bowdenfit.questions.summary.verdict import NOT_CONVERGED, assess_fit
from bowdenfit.results.record import Draws, Record
from bowdenfit.stages import announce_stage
from bowdenfit.words import listed

_COMPARED_ROLES = {"friction", "friction_model", "sensor"}
Report = Callable[[str], None]


@dataclass(frozen=True)
class ComparedParameter:
    """A parameter of several fits.

    Args:
        symbol: For figures.
        unit: "1" where there is none.
        by_fit: Its value and uncertainty in each fit that has it.
        meaning: Meaning in words.
    """

    symbol: str
    unit: str
    by_fit: dict[str, Interval]
    meaning: str = ""


@dataclass(frozen=True, repr=False)
class Comparison(Display):
    """Result of a comparison of several fits.

    Args:
        differences: How well each predicts readings left out, the best first.
        weights: Weights of each in the mixture of all that predicts best.
        predictions: Predictions of each, reading by reading.
        omitted: Readings that the fits do not share.
        descriptions: Assumptions of each fit, in words.
        parameters: Coefficients and the like, by parameter and fit.
        optimal_length: Optimal length of each fit with a route, with its unit.
        rate_effects: Rate effects of the fits in which friction may depend on speed.
        left_out: Part that was left out at a time: a whole run, its readings at one load, or one of them.
        few_runs: Number of runs, where so few are left out in parts unasked; 0 else.
        troubles: Why fits are not to be trusted, by fit; those that are to be have none.
        other_priors: Parameters whose priors are all that a fit differs in from the one that predicts best, by fit; those that
            differ in more are not there.
    """

    differences: dict[str, ElpdDifference]
    weights: dict[str, float]
    predictions: dict[str, LooPrediction]
    omitted: tuple[OmittedReadings, ...]
    descriptions: dict[str, str]
    parameters: dict[str, ComparedParameter]
    optimal_length: dict[str, tuple[Interval, str]]
    rate_effects: dict[str, RateEffect]
    left_out: LeaveOut = "run"
    few_runs: int = 0
    troubles: dict[str, tuple[str, ...]] = field(default_factory=dict)
    other_priors: dict[str, tuple[str, ...]] = field(default_factory=dict)

    JSON: ClassVar = (
        "fits",
        ("readings", "predicted_readings"),
        ("not_compared", "omitted"),
        ("parameters", "intervals"),
        ("optimal_length", "optimal_lengths"),
        ("rate_effect", "rate_effects"),
        "left_out",
        "trusted",
    )

    @property
    def best(self) -> str:
        """The fit that predicts best."""
        return next(iter(self.differences))

    @property
    def trusted(self) -> bool:
        """Whether the fit that predicts best is to be trusted, and the draws of all have settled, which scores rest on."""
        return not self.troubles.get(self.best) and not any(
            NOT_CONVERGED in troubles for troubles in self.troubles.values()
        )

    @property
    def readings(self) -> tuple[tuple[str, str], ...]:
        """Table and label of every reading that is compared."""
        return self.predictions[self.best].readings

    @property
    def counts_runs(self) -> bool:
        """Whether some of the readings are whole runs."""
        return self.left_out == "run" and any(find_readings(table).are_runs for table, _ in self.readings)

    def pointwise(self, name: str) -> np.ndarray:
        """Return how much worse a fit predicts each reading than the best one does."""
        return self.predictions[self.best].elpd - self.predictions[name].elpd

    def verdict(self, name: str) -> str:
        """Say whether the data can tell a fit from the best: "clear", "leaning" or "open"."""
        return self.differences[name].verdict(len(self.readings))

    @property
    def fits(self) -> tuple[dict[str, Any], ...]:
        """How well each predicts, the best first."""
        return tuple(
            {
                "name": name,
                "model": self.descriptions[name],
                "elpd": self.predictions[name].elpd.sum(),
                "elpd_difference": d.elpd,
                "standard_error": d.standard_error,
                "monte_carlo_error": np.sqrt(np.sum(self.predictions[name].error ** 2)),
                "stacking_weight": self.weights[name],
                "unreliable_readings": d.unreliable,
                "verdict": "best" if name == self.best else self.verdict(name),
                "troubles": listed(self.troubles.get(name, ())),
            }
            for name, d in self.differences.items()
        )

    def _table(self) -> Rows:
        return self.fits, {name: "1" for name, value in self.fits[0].items() if isinstance(value, float)}

    @property
    def predicted_readings(self) -> tuple[dict[str, Any], ...]:
        """What each fit says of each reading."""
        return tuple(
            {
                "table": table,
                "label": label,
                "fits": {name: p.describe_reading(i) for name, p in self.predictions.items()},
            }
            for i, (table, label) in enumerate(self.readings)
        )

    @property
    def intervals(self) -> dict[str, dict[str, Interval]]:
        """Parameters by name and fit."""
        return {name: row.by_fit for name, row in self.parameters.items()}

    @property
    def optimal_lengths(self) -> dict[str, dict[str, Any]]:
        """Optimal lengths by fit, with their unit."""
        return {name: vars(interval) | {"unit": unit} for name, (interval, unit) in self.optimal_length.items()}


def compare_fits(
    fits: Mapping[str, Record], report: Report | None = None, leave_out: LeaveOut | None = None
) -> Comparison:
    """Compare fits.

    Args:
        fits: By name.
        report: Called with a sentence before each reading that needs a refit or the like.
        leave_out: What is left out of a run at a time; if omitted, the whole of it, or where runs are few its readings at
            one load.

    Raises:
        UsageError: There are fewer than two, one has no posterior, they are not of the same readings, or nothing is left
            once a reading is left out.
    """
    with jax.enable_x64(True):
        return _compare_fits(fits, report, leave_out)


def _compare_fits(fits: Mapping[str, Record], report: Report | None, leave_out: LeaveOut | None) -> Comparison:
    if len(fits) < 2:
        raise UsageError("a comparison needs at least two fits; name their results folders, two different ones.")
    draws = {name: _require_draws(name, fit) for name, fit in fits.items()}
    unit, few, parts = choose_parts(fits, leave_out)
    common = find_common_readings(fits, parts)
    predictions = {
        name: _predict_left_out(name, fit, draws[name], common, parts[name], report) for name, fit in fits.items()
    }
    differences = compare_predictions(predictions)
    ordered = {name: fits[name] for name in differences}
    weights = stacking_weights(predictions)
    return Comparison(
        differences,
        {name: weights[name] for name in differences},
        {name: predictions[name] for name in differences},
        common.omitted,
        _describe_fits(ordered),
        _compare_parameters(ordered),
        {
            n: (find_optimal_length(f).length, f.dataset.description.route.unit)
            for n, f in ordered.items()
            if f.dataset.description.route
        },
        {name: effect for name, fit in ordered.items() if (effect := compare_speeds(fit)) is not None},
        unit,
        few,
        {
            name: tuple(fit_verdict.troubles)
            for name, fit in ordered.items()
            if (fit_verdict := assess_fit(fit)).troubles
        },
        _find_other_priors(ordered),
    )


def _find_other_priors(fits: Mapping[str, Record]) -> dict[str, tuple[str, ...]]:
    """Return the parameters whose priors are all that a fit differs in from the first one, by fit."""
    (_, first), *others = fits.items()
    return {name: names for name, fit in others if (names := _list_other_priors(first, fit))}


def _list_other_priors(one: Record, other: Record) -> tuple[str, ...]:
    """Return the parameters whose priors two fits differ in; empty where they differ in anything else, or in none."""
    without_priors = [
        fit.dataset.description.model_dump(exclude={"friction", "prior", "sampler", "name", "source"}) for fit in (one, other)
    ]
    fixed, of_other = ({p.name: p.fixed for p in fit.model.space.parameters} for fit in (one, other))
    if without_priors[0] != without_priors[1] or fixed != of_other:
        return ()
    pairs = zip(one.model.space.free, other.model.space.free, strict=True)  # in one order, as their descriptions are alike
    return tuple(p.name for p, q in pairs if p.prior != q.prior)


def _require_draws(name: str, fit: Record) -> Draws:
    if fit.sampled is None:
        raise UsageError(f"{name} has no posterior, because it was made without MCMC; fit it again without --no-mcmc.")
    return fit.posterior


def _predict_left_out(
    name: str, fit: Record, draws: Draws, common: CommonReadings, parts: Mapping[str, RunParts], report: Report | None
) -> LooPrediction:
    """Return the expected log density of every reading, had it been left out."""
    announce_stage(f"leaving out readings of {name}")
    return leave_one_out(
        LooDensity(Density(fit.model), parts=parts),
        draws.z,
        draws.log_likelihood,
        draws.n_effective,
        fit.provenance.seed,
        common.positions[name],
        lambda sentence: report(f"{name}: {sentence}") if report is not None else None,
    )


def _describe_fits(fits: Mapping[str, Record]) -> dict[str, str]:
    """Say what sets each fit apart; the families of its curves where the fits do not agree on them."""
    families = {name: _list_curve_families(fit.dataset.description) for name, fit in fits.items()}
    differ = len(set(families.values())) > 1
    return {name: _describe_fit(fit) + (f", {families[name]}" if differ else "") for name, fit in fits.items()}


def _list_curve_families(description: Description) -> str:
    """Return the families of its curves, one word where all are of one, else in the order of the contacts."""
    curves = [c.wrap_angle.curve or "" for c in description.curved]
    return f"{listed(curves if len(set(curves)) > 1 else curves[:1])} curves"


def _describe_fit(fit: Record) -> str:
    """Say what sets a fit apart from others of the same data."""
    description = fit.dataset.description
    parts = [description.friction_model, *([description.laws_in_words] if description.laws_in_words else [])]
    if description.curved:
        parts.append(f"{description.geometry} geometry")
    parts += [description.noise_in_words] if description.noise != "normal" else []
    parts += [
        choice for kind, _ in iterate_term_kinds(fit.dataset.measurements) if (choice := kind.describe_choice(description))
    ]
    without_runs = [p for p in fit.model.space.fixed if p.name == RUN_SCATTER and p.fixed == 0.0]
    fixed = [p.name for p in fit.model.space.fixed if p not in without_runs]
    parts += ["no run effect"] if without_runs else []
    return ", ".join(parts + ([f"{', '.join(fixed)} fixed"] if fixed else []))


def _compare_parameters(fits: Mapping[str, Record]) -> dict[str, ComparedParameter]:
    rows: dict[str, ComparedParameter] = {}
    for name, fit in fits.items():
        for p in fit.model.space.free:
            if p.role in _COMPARED_ROLES and fit.sampled is not None:
                row = rows.setdefault(p.name, ComparedParameter(p.symbol, p.unit, {}, p.meaning))
                row.by_fit[name] = Interval.of(np.asarray(fit.posterior.values[p.name]))
    return rows
