"""The whole summary (`details.txt`): verdict, coefficients, measured beside predicted, the design answer."""

from math import isfinite
from typing import Any

from bowdenfit.cable.curves import Curve
from bowdenfit.cable.sensors import RUN_SCATTER
from bowdenfit.display import render_text
from bowdenfit.inference.interval import Interval
from bowdenfit.inference.least_squares import KINKED, Estimate
from bowdenfit.kinds import find_readings
from bowdenfit.kinds.recordings.kind import describe_preparations
from bowdenfit.parameters.space import Parameter
from bowdenfit.questions.bends.words import describe_elastic
from bowdenfit.questions.check.answer import check_readings
from bowdenfit.questions.check.words import describe_checks
from bowdenfit.questions.error_budget import answer_interval, budget_text, find_optimal_length
from bowdenfit.questions.groups import groups_text
from bowdenfit.questions.identify.answer import describe_identified
from bowdenfit.questions.identify.judgment import assess_identifiability, confounded_pairs
from bowdenfit.questions.identify.verb import NOT_IDENTIFIABLE
from bowdenfit.questions.loss import loss_text
from bowdenfit.questions.motor_gear import GEAR_NOTE
from bowdenfit.questions.recorded.friction_effects import (
    SHOWN_SPEED,
    compare_speeds,
    compute_lost_force,
    predict_stick_slip,
)
from bowdenfit.questions.recorded.presliding import estimate_presliding
from bowdenfit.questions.summary.curve_departures import describe_departures
from bowdenfit.questions.summary.methods import describe_fitted_data, sampler_sentences, sampler_text
from bowdenfit.questions.summary.page import summarize
from bowdenfit.questions.summary.verdict import (
    COARSE,
    CONTRADICTORY,
    COPIED,
    CUT_OFF,
    IMPOSSIBLE,
    NOT_CONVERGED,
    NOT_DESCRIBED,
    Verdict,
    assess_fit,
)
from bowdenfit.recordings.recording import Recordings
from bowdenfit.results.record import Record
from bowdenfit.words import decimals, filled, listed, percent, significant, table

_UNLIMITED = 2000.0  # deg or mm, beyond which a curve coefficient counts as not limited; a judgement
_PRIOR_DRIVEN = 0.2  # contraction below which a parameter is said to rest on its prior alone; a judgement


_HEADS = (
    "parameter", "median", "90 % interval", "mean ± sd", "least squares ± s.e.", "90 % profile interval", "prior", "unit",
)  # fmt: skip
_ALWAYS = (0, 4, 6)  # columns that are shown even where they are empty
_WIDE = 2.5  # standard errors to each side beyond which an interval needs a word; of many readings they are 1.6 (NORMAL_90)
def details_text(fit: Record) -> str:
    """Return everything that a fit says, for people."""
    page = summarize(fit)
    blocks = [
        _title_block(fit),
        _verdict_block(fit, page),
        parameters_text(fit),
        groups_text(fit),
        _identified_sentence(fit),
        _prior_driven_sentence(fit, page),
        _curve_block(fit, page),
        *(filled(sentence) for sentence in describe_departures(fit)),
    ]
    blocks += [
        _residual_sentence(page),
        _mounting_scatter_block(fit, page),
        _recordings_block(fit),
        _measured_block(fit, page),
        describe_checks(check_readings(fit)),
        _friction_model_block(fit),
        render_text(describe_elastic(fit)).strip(),
        loss_text(fit),
        budget_text(fit),
        _design_answer(fit),
    ]
    blocks.append(_origin_sentence(page))
    return "\n\n".join(block for block in blocks if block) + "\n"


def _title_block(fit: Record) -> str:
    """Return the name of the cable and what was fitted."""
    remarks = [filled(remark) for remark in fit.dataset.measurements.remarks]
    return "\n".join([fit.name, "=" * len(fit.name), filled(describe_fitted_data(fit)), *remarks])


def _verdict_block(fit: Record, page: dict[str, Any]) -> str:
    """Return the verdict, its reasons, and how the sampling went."""
    fit_verdict = assess_fit(fit)
    if fit.sampled is None:
        state = "least squares only; no posterior, no design answer" if fit_verdict.trusted else _problem_headline(fit_verdict)
    else:
        state = "converged" if fit_verdict.trusted else _problem_headline(fit_verdict)
        sampler = page["sampler"]
        state += f" ({sampler_text(sampler)})"
    lines = [f"Verdict: {state}."]
    lines += [filled(f"- {reason}", indent="  ") for reason in fit_verdict.reasons]
    lines += [filled(sentence) for sentence in sampler_sentences(page)]
    if NOT_IDENTIFIABLE not in fit_verdict.troubles:  # which says so of the same parameters
        lines += [filled(c.sentence()) for c in confounded_pairs(fit)]
    return "\n".join(lines)


def _problem_headline(fit_verdict: Verdict) -> str:
    """Return what is wrong, in capitals that nobody overlooks."""
    kinds = {
        NOT_IDENTIFIABLE: "COEFFICIENTS NOT IDENTIFIABLE",
        CONTRADICTORY: "CONTRADICTORY MEASUREMENTS",
        IMPOSSIBLE: "IMPOSSIBLE READINGS",
        COPIED: "COPIED READINGS",
        CUT_OFF: "READINGS CUT OFF",
        COARSE: "READINGS TOO COARSE",
        NOT_DESCRIBED: "THE MODEL DOES NOT DESCRIBE THESE READINGS",
    }
    if NOT_CONVERGED in fit_verdict.troubles:
        return "NOT CONVERGED; do not use these numbers"
    return f"{listed([kinds[kind] for kind in fit_verdict.troubles])}; do not use these numbers before reading why"


def _identified_sentence(fit: Record) -> str:
    """Say which coefficients the measurements determine."""
    friction = assess_identifiability(fit).groups.get("friction") if fit.sampled is not None else None
    return filled(describe_identified(friction, measured=True)) if friction is not None else ""


def _prior_driven_sentence(fit: Record, page: dict[str, Any]) -> str:
    """Name the parameters that rest on their prior almost alone, but for weights of departures; empty without any."""
    weights = {p.name for p in fit.model.space.free if p.role == "departure"}
    names = [
        n
        for n, p in page["parameters"].items()
        if n not in weights and p.get("contraction") is not None and p["contraction"] < _PRIOR_DRIVEN
    ]
    if not names:
        return ""
    verb = "rests" if len(names) == 1 else "rest"
    return filled(f"Barely determined by the measurements: {listed(names)} {verb} on the prior almost alone.")


def _curve_block(fit: Record, page: dict[str, Any]) -> str:
    """Return derived quantities of the curves, a table for each family."""
    if fit.sampled is None:
        return ""
    families: dict[type[Curve], list[str]] = {}
    for curve in fit.model.cable.curves.values():
        families.setdefault(type(curve), []).extend(curve.derived_units())
    return "\n\n".join(_curve_family_lines(family, names, page["curves"]) for family, names in families.items() if names)


def _curve_family_lines(family: type[Curve], names: list[str], page: dict[str, Any]) -> str:
    """Return derived quantities of the curves of one family."""
    lines, note = [f"{family.heading}, median (90 % interval):"], False
    for name in names:
        c = page[name]
        unlimited = bool(family.not_limited) and any(
            c[q] is None or abs(c[q]) > _UNLIMITED for q in ("q05", "median", "q95")
        )
        interval = "not limited" if unlimited else f"{c['median']:.4g} ({c['q05']:.4g} to {c['q95']:.4g}) {c['unit']}"
        lines.append(f"  {name:<30} {interval}")
        note = note or unlimited
    return "\n".join([*lines, *([filled(f"Not limited: {family.not_limited}", indent="  ")] if note else [])])


def _residual_sentence(page: dict[str, Any]) -> str:
    """Return the residual standard deviation of every table, in a sentence."""
    deviations = [(find_readings(name), sd) for name, sd in page["least_squares"]["residual_sd"].items() if sd is not None]
    parts = [
        f"{called.name.replace('_', ' ')} {called.shown_scale * sd:.2f} {called.scatter_unit}"
        for called, sd in deviations
        if called.scatter_unit
    ]
    return filled(f"Residual standard deviation of least squares: {listed(parts)}.") if parts else ""


def _mounting_scatter_block(fit: Record, page: dict[str, Any]) -> str:
    """Describe the scatter from mounting to mounting."""
    tau, runs = (
        page["parameters"].get(RUN_SCATTER, {}),
        {r["label"] for r in page["measured"] if find_readings(r["table"]).are_runs},
    )
    if "median" not in tau or not runs:
        return ""
    shown = (f"{100 * tau[q]:.1f}" for q in ("median", "q05", "q95"))
    median, low, high = shown
    heavy = (
        " That is the scale of a Student-t, not a standard deviation: about six mountings in ten lie within it, and now and "
        "then one lies far outside."
        if fit.dataset.description.noise == "student"
        else ""
    )
    return filled(
        f"From one mounting of the cable to the next the efficiency scatters by {median} % of itself (90 % interval {low} to "
        f"{high} %). All samples of a run share its mounting effect, so more runs, not longer ones, narrow the "
        f"coefficients.{heavy}"
    )


def _recordings_block(fit: Record) -> str:
    """Describe the recordings; empty without any."""
    recordings = fit.dataset.measurements.table(Recordings)
    return "Recordings\n" + "\n".join(describe_preparations(recordings)) if recordings is not None else ""


def _friction_model_block(fit: Record) -> str:
    """Describe what the options of the friction model found."""
    friction = fit.model.cable.friction
    if not friction.options:
        return ""
    conditions, lines = friction.conditions, []
    if friction.depends_on_load:
        lines.append(
            f"Coefficients, efficiency curves and the best length are stated for an input force of "
            f"{conditions.reference_force:g} N, because friction depends on the load; measured efficiencies hold at the force "
            "given with them."
        )
        lost = compute_lost_force(fit)
        lines += [lost.explanation()] if lost is not None else []
    if friction.depends_on_stroke:
        lines.append(
            "Coefficients are the mean of pulling and returning; efficiencies and the best length are those of pulling."
        )
    if friction.depends_on_rate:
        unit, scale = SHOWN_SPEED[conditions.velocity_unit]
        speed = f"{significant(scale * conditions.reference_speed)} {unit}"
        lines.append(
            f"Coefficients and efficiencies are stated for a speed of {speed}, because friction may depend on speed."
        )
    effect = compare_speeds(fit)
    if effect is not None:
        lines.append(effect.sentence())
    if (falls := predict_stick_slip(fit)) is not None:
        lines.append(falls.sentence())
    if (presliding := estimate_presliding(fit)) is not None:
        lines.append(presliding.sentence())
    return "\n".join(filled(line) for line in lines)


def _measured_block(fit: Record, page: dict[str, Any]) -> str:
    """Return measured beside predicted efficiencies in a table; empty without any."""
    if not page["measured"]:
        return ""
    has_draws = fit.sampled is not None
    load_head = ["at input"] if any("input_force_N" in row for row in page["measured"]) else []
    heads = ["measured at", *load_head, "measured", "predicted", *(["90 % interval"] if has_draws else [])]
    heads += ["measured/predicted - 1"]
    rows = []
    for row in page["measured"]:
        interval = [f"{percent(row['q05'], 2)} to {percent(row['q95'], 2)}"] if has_draws else []
        what = "run " if find_readings(row["table"]).are_runs else ""
        rows.append(
            [
                what + row["label"],
                *([f"{significant(row['input_force_N'])} N"] if load_head else []),
                percent(row['measured'], 2),
                percent(row['predicted'], 2),
                *interval,
                percent(row['relative_error'], 2, "+"),
            ]
        )
    note = f"\n{filled(GEAR_NOTE)}" if fit.dataset.description.motor is not None else ""
    return f"Efficiency, measured and predicted\n{table(heads, rows)}{note}"


def _design_answer(fit: Record) -> str:
    """Return the best length; empty without a route or draws."""
    if fit.sampled is None or fit.dataset.description.route is None:
        return ""
    return str(find_optimal_length(fit))


def _origin_sentence(page: dict[str, Any]) -> str:
    """Return the seed and the versions of libraries."""
    versions = ", ".join(f"{name} {version}" for name, version in page["versions"].items())
    return filled(f"Seed {page['seed']}; {versions}.")


def parameters_text(fit: Record) -> str:
    """Return every parameter in a table, and remarks on least squares."""
    estimates, intervals = fit.least_squares.estimates, posterior_intervals(fit)
    listed_parameters = [p for p in fit.model.space.parameters if p.role != "departure"]
    rows = [_row(p, intervals.get(p.name), estimates.get(p.name), bool(intervals)) for p in listed_parameters]
    shown_names = {p.name for p in listed_parameters}
    keep = [i for i in range(len(_HEADS)) if i in _ALWAYS or any(row[i] for row in rows)]
    shown = table([_HEADS[i] for i in keep], [[row[i] for i in keep] for row in rows])
    notes = [
        filled(f"{name} is {_describe_problem(estimate)}: {estimate.remark}.")
        for name, estimate in estimates.items()
        if not estimate.identified and name in shown_names
    ]
    condition = fit.least_squares.condition_number
    number = f"{condition:.3g}" if isfinite(condition) else "infinite"
    notes.append(f"Condition number of the least-squares problem: {number}.")
    kinked = [] if intervals else [name for name, estimate in estimates.items() if estimate.remark == KINKED]
    if kinked:
        reason = f"{'have' if kinked[1:] else 'has'} {KINKED}. Sampling gets past kinks: fit without --no-mcmc."
        notes.append(filled(f"{listed(kinked)} {reason}"))
    wide = [] if intervals else [name for name, estimate in estimates.items() if _is_wide(estimate)]
    if wide:
        notes.append(
            filled(
                f"The intervals of {listed(wide)} are wider than their standard errors suggest: hardly more readings than "
                "parameters leave little to estimate the scatter from, or the sum of squares is lopsided."
            )
        )
    by = [f"{p.name} by {p.scaled_by}" for p in fit.model.space.parameters if p.scaled_by]
    notes += [filled(f"Priors that follow the measurements: {'; '.join(by)}.")] if by else []
    return "\n".join([shown, *notes])


def posterior_intervals(fit: Record) -> dict[str, Interval]:
    """Return the interval of every parameter that was sampled, errors of the bench included; empty without draws."""
    return {p.name: answer_interval(fit, p.name) for p in fit.model.space.free} if fit.sampled is not None else {}


def _row(parameter: Parameter, interval: Interval | None, estimate: Estimate | None, sampled: bool) -> tuple[str, ...]:
    """Return the cells of a parameter, see `_HEADS`."""
    posterior_cells = _format_moments(interval) if interval is not None else ("", "", "")
    # Beside a posterior's intervals there is no room for others; those are in summary.json.
    profiled = "" if sampled or estimate is None else _format_profile_interval(estimate)
    least_squares = "" if estimate is None else _format_estimate(estimate)
    if parameter.fixed is not None:
        least_squares = f"{parameter.fixed * parameter.shown_scale:.4g} (fixed)"
    return parameter.name, *posterior_cells, least_squares, profiled, parameter.prior_text, _unit(parameter)


def _unit(parameter: Parameter) -> str:
    """Return the unit of a parameter; empty without one."""
    return "" if parameter.unit == "1" else parameter.unit


def _format_moments(interval: Interval) -> tuple[str, str, str]:
    """Format median, interval, and mean with standard deviation."""
    median, low, high, mean, sd = (
        f"{value:z.{decimals(interval.sd)}f}"
        for value in (interval.median, interval.q05, interval.q95, interval.mean, interval.sd)
    )
    return median, f"{low} to {high}", f"{mean} ± {sd}"


def _format_estimate(estimate: Estimate) -> str:
    """Format an estimate with its standard error."""
    if not estimate.identified:
        return _say_why_missing(estimate)
    digits = _digits(estimate, abs(estimate.value) / 1000)
    return f"{estimate.value:z.{digits}f} ± {estimate.standard_error:z.{digits}f}"


def _say_why_missing(estimate: Estimate) -> str:
    """Say why there is no estimate."""
    return "at bound" if estimate.at_bound else "not identified"


def _digits(estimate: Estimate, otherwise: float) -> int:
    """Return the decimals that go with a standard error, where there is one."""
    error = estimate.standard_error
    return decimals(error if isfinite(error) and error else otherwise)


def _format_profile_interval(estimate: Estimate) -> str:
    """Format the profile interval of least squares; empty where it was not computed."""
    finite = [limit for limit in (estimate.lower, estimate.upper) if isfinite(limit)]
    if not finite:
        return "not limited" if estimate.open else ""
    digits = _digits(estimate, (finite[-1] - finite[0]) / 3 or 1.0)
    shown = [f"{limit:z.{digits}f}" for limit in finite]
    if estimate.open:
        return f"{shown[0]} or more" if "upper" in estimate.open else f"{shown[0]} or less"
    return " to ".join(shown)


def _is_wide(estimate: Estimate) -> bool:
    """Return whether the interval is much wider than the standard error says."""
    width, error = estimate.upper - estimate.lower, estimate.standard_error
    return estimate.identified and isfinite(width) and isfinite(error) and width > 2 * _WIDE * error


def _describe_problem(estimate: Estimate) -> str:
    """Describe an estimate that is not identified."""
    return "at its bound in least squares" if estimate.at_bound else "not identified by least squares"
