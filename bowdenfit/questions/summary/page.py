"""The one page that programs read: `summary.json`; people's versions are made from the same numbers."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from bowdenfit.display import Block, Display, Rows, blocks_of
from bowdenfit.inference.diagnostics import describe_convergence_shortfalls, quantile_error
from bowdenfit.inference.draws import derived_units
from bowdenfit.inference.interval import Interval
from bowdenfit.inference.sampler_agreement import recommend_sampler
from bowdenfit.kinds import find_readings
from bowdenfit.kinds.recordings.kind import list_preparations
from bowdenfit.kinds.runs import RunsData
from bowdenfit.kinds.term import Term
from bowdenfit.questions.bends.words import elastic_overview
from bowdenfit.questions.check.answer import check_readings
from bowdenfit.questions.error_budget import answer_interval, error_budget, find_optimal_length, with_bench_errors
from bowdenfit.questions.groups import contrast_groups
from bowdenfit.questions.identify.judgment import confounded_pairs
from bowdenfit.questions.loss import loss_by_contact
from bowdenfit.questions.motor_gear import gear_factors
from bowdenfit.questions.recorded.friction_effects import compare_speeds, compute_lost_force, predict_stick_slip
from bowdenfit.questions.summary.verdict import agreement_page, assess_fit
from bowdenfit.recordings.recording import Recordings
from bowdenfit.results.record import Draws, Record
from bowdenfit.results.serialization import plain_data, values_by_key

SCHEMA = 1  # of summary.json; counts up when its shape or meaning changes


class Summary(Display, dict[str, Any]):
    """The contents of summary.json, which show themselves as people read them.

    Args:
        page: The contents.
        make_blocks: Gives the same for people.
    """

    def __init__(self, page: dict[str, Any], make_blocks: Callable[[], Sequence[Block]]) -> None:
        super().__init__(page)
        self.make_blocks = make_blocks

    def _table(self) -> Rows:
        rows = {name: {k: v for k, v in row.items() if k != "least_squares"} for name, row in self["parameters"].items()}
        return [{"parameter": name} | row for name, row in rows.items()], {name: row["unit"] for name, row in rows.items()}


@blocks_of.register
def _(summary: Summary) -> Sequence[Block]:
    """Return what people read."""
    return summary.make_blocks()


def summarize(fit: Record) -> dict[str, Any]:
    """Summarize a fit as plain data; NaN where a number does not exist is None.

    Args:
        fit: The fit.
    """
    page: dict[str, Any] = {
        "schema": SCHEMA,
        "name": fit.name,
        "geometry": fit.dataset.description.geometry,
        "verdict": _verdict_page(fit),
        "parameters": {p.name: _parameter_row(fit, p.name) for p in fit.model.space.parameters},
        "curves": {name: _curve_row(fit, name) for name in curve_coefficients(fit)},
        "least_squares": {
            "residual_sd": fit.least_squares.residual_sd,
            "condition_number": fit.least_squares.condition_number,
            "sum_of_squares": fit.least_squares.sum_of_squares,
            "converged": fit.least_squares.converged,
        },
        "agreement": agreement_page(fit),
        "departures": fit.least_squares.departures,
        "measured": _measured_efficiencies(fit),
        "friction_model": fit.dataset.description.friction_model,
        "confounded": confounded_pairs(fit),
        "seed": fit.provenance.seed,
        "versions": dict(fit.provenance.versions),
    }
    if (recordings := fit.dataset.measurements.table(Recordings)) is not None:
        page["recordings"] = list_preparations(recordings)
    if elastic := elastic_overview(fit):
        page["elastic"] = elastic
    if groups := contrast_groups(fit):
        page["groups"] = groups
    if checks := check_readings(fit):
        page["checks"] = checks
    if (loss := loss_by_contact(fit)) is not None:
        page["loss"] = loss
    if (budget := error_budget(fit)) is not None:
        page["error_budget"] = budget
    if (lost := compute_lost_force(fit)) is not None:
        page["drag"] = lost
    effect = compare_speeds(fit)
    if effect is not None:
        page["rate_effect"] = effect
    if (falls := predict_stick_slip(fit)) is not None:
        page["stick_slip"] = falls
    if fit.sampled is not None:
        page["sampler"] = _sampler_page(fit, fit.posterior)
        if fit.posterior.agreement is not None:
            page["samplers"] = fit.posterior.agreement
        if fit.dataset.description.route is not None:
            page["optimal"] = find_optimal_length(fit)
    everything: dict[str, Any] = plain_data(page)
    return everything


def _verdict_page(fit: Record) -> dict[str, Any]:
    """What may be used of a fit, and why the rest may not."""
    fit_verdict = assess_fit(fit)
    return {
        "converged": fit.converged,
        "trusted": fit_verdict.trusted,
        "usable": fit_verdict.may_be_used_for("design"),
        "reasons": list(fit_verdict.reasons),
        "doubts": list(fit_verdict.doubts),
        "answers": fit_verdict.answers,
    }


def _sampler_page(fit: Record, posterior: Draws) -> dict[str, Any]:
    """Return how the draws were sampled, and what is recommended instead ("" if nothing is)."""
    settings = fit.dataset.description.sampler
    shortfalls = describe_convergence_shortfalls(posterior.diagnostics, settings.target_r_hat, settings.target_ess)
    page: dict[str, Any] = {
        "method": posterior.sampler,
        "ensembles": posterior.n_ensembles,
        "walkers": len(posterior.z) // posterior.n_ensembles,
        "steps": posterior.steps,
        "acceptance": posterior.acceptance,
        "monte_carlo_errors": _monte_carlo_errors(posterior),
        "recommendation": recommend_sampler(posterior.sampler, fit.model.space.size, bool(shortfalls)),
    }
    if posterior.trajectories is not None:
        page |= {k: v for k, v in values_by_key(posterior.trajectories).items() if k != "statistics"}
    if posterior.pareto_k is not None:
        page["pareto_k"] = posterior.pareto_k
    return page


def _monte_carlo_errors(posterior: Draws) -> dict[str, dict[str, float]]:
    """Return the Monte Carlo standard error of the middle and the ends of each interval, by quantity."""
    quantiles = {"q05": 0.05, "median": 0.5, "q95": 0.95}
    return {
        name: {end: quantile_error(draws, posterior.n_ensembles, at) for end, at in quantiles.items()}
        for name, draws in (posterior.values | posterior.optimum).items()
    }


def _parameter_row(fit: Record, name: str) -> dict[str, Any]:
    """Return what is known of a parameter, as plain data."""
    parameter = next(p for p in fit.model.space.parameters if p.name == name)
    row: dict[str, Any] = {"unit": parameter.unit, "meaning": parameter.meaning, "prior": parameter.prior_text}
    if parameter.scaled_by:
        row["prior_scaled_by"] = parameter.scaled_by
    if parameter.fixed is not None:
        row["fixed"] = parameter.fixed * parameter.shown_scale
    if name in fit.least_squares.estimates:
        row["least_squares"] = fit.least_squares.estimates[name]
    if fit.sampled is not None and name in fit.posterior.values:
        draws, diagnostics = fit.posterior.values[name], fit.posterior.diagnostics[name]
        row |= vars(answer_interval(fit, name)) | {
            "ess_bulk": diagnostics.ess_bulk,
            "ess_tail": diagnostics.ess_tail,
            "r_hat": diagnostics.r_hat,
            "mcse_mean": float(np.std(draws) / np.sqrt(max(diagnostics.ess_bulk, 1.0))),
            "contraction": contraction(fit, name),
        }
    return row


def contraction(fit: Record, name: str) -> float:
    """Return how much narrower the posterior is than the prior, in z: 1 where data decide, 0 where the prior alone speaks."""
    return float(1 - np.var(fit.posterior.z[..., fit.model.space.index[name]]))


def curve_coefficients(fit: Record) -> dict[str, tuple[str, str]]:
    """Return unit and symbol of each derived curve coefficient."""
    return derived_units(fit.model)


def _curve_row(fit: Record, name: str) -> dict[str, Any]:
    """Return what is known of a derived curve coefficient, as plain data."""
    row: dict[str, Any] = {"unit": curve_coefficients(fit)[name][0]}
    if fit.sampled is not None:
        draws = with_bench_errors(fit).posterior.values[name]
        ordered = np.sort(draws, axis=None)  # some may be infinite, and are not to be interpolated
        q05, median, q95 = (ordered[round(q * (len(ordered) - 1))] for q in (0.05, 0.5, 0.95))
        row |= {"median": float(median), "q05": float(q05), "q95": float(q95)}
    return row


def _input_forces(fit: Record, term: Term) -> np.ndarray:
    """Return the input force at which each efficiency holds [N], where friction depends on it; of a run its weighted mean."""
    friction, data = fit.model.cable.friction, term.data
    if not friction.depends_on_load:
        return np.zeros(0)
    if not isinstance(data, RunsData):
        return np.full(len(term.labels), friction.conditions.reference_force)
    weight, run, n = data.cells.weight, data.cells.run, len(term.labels)
    return np.asarray(np.exp(np.bincount(run, weight * np.log(data.cells.input_force), n) / np.bincount(run, weight, n)))


def _measured_efficiencies(fit: Record) -> list[dict[str, Any]]:
    """Return every measured efficiency beside what the fit says of it (as section 3.2 of the on-body paper does).

    The relative error is measured over predicted, less 1. Without draws the prediction is least squares'.
    """
    rows = []
    for term in fit.model.terms:
        if not find_readings(term.name).are_efficiencies:
            continue
        factors, forces = gear_factors(fit, term), _input_forces(fit, term)
        observed = factors * term.observed()
        for i, label in enumerate(term.labels):
            row: dict[str, Any] = {"table": term.name, "label": label, "measured": float(observed[i])}
            if fit.sampled is not None:
                expected = Interval.of(factors[i] * fit.posterior.expected[term.name][..., i])
                replicated = factors[i] * fit.posterior.replicated[term.name][..., i]
                row |= {"predicted": expected.median, "q05": expected.q05, "q95": expected.q95}
                row["predictive_q05"], row["predictive_q95"] = (float(q) for q in np.quantile(replicated, (0.05, 0.95)))
            else:
                row["predicted"] = float(factors[i] * fit.least_squares.readings[term.name][i])
            if len(forces):
                row["input_force_N"] = float(forces[i])
            row["relative_error"] = row["measured"] / row["predicted"] - 1
            rows.append(row)
    return rows
