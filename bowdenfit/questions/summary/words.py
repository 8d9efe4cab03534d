"""The whole summary (`details.txt`): verdict, coefficients, measured beside predicted, the design answer."""

from typing import Any

from bowdenfit.cable.curves import Curve
from bowdenfit.cable.load_cells import RUN_SCATTER
from bowdenfit.kinds import each_table, readings_called
from bowdenfit.kinds.recordings.kind import recordings_text
from bowdenfit.kinds.terms import term_kind
from bowdenfit.questions.bends.words import describe_elastic
from bowdenfit.questions.check.answer import checks_of
from bowdenfit.questions.check.words import describe_checks
from bowdenfit.questions.groups.words import groups_text
from bowdenfit.questions.identify.answer import say_what_is_determined
from bowdenfit.questions.identify.confounding import confounded_pairs
from bowdenfit.questions.identify.judgment import identifiability
from bowdenfit.questions.identify.verb import NOT_IDENTIFIABLE
from bowdenfit.questions.loss.words import loss_text
from bowdenfit.questions.recorded.lost_force import lost_force
from bowdenfit.questions.recorded.rate import SHOWN_SPEED, rate_effect
from bowdenfit.questions.recorded.stick_slip import stick_slip
from bowdenfit.questions.summary.page import summarize
from bowdenfit.questions.summary.parameter_words import parameters_text
from bowdenfit.questions.summary.sampler_words import sampler_sentences, sampler_text
from bowdenfit.questions.summary.verdict import (
    COARSE,
    CONTRADICTORY,
    COPIED,
    IMPOSSIBLE,
    NOT_CONVERGED,
    NOT_DESCRIBED,
    Verdict,
    verdict,
)
from bowdenfit.recordings.recording import Recordings
from bowdenfit.results.record import Record
from bowdenfit.words import filled, listed, percent, significant, table

_UNLIMITED = 2000.0  # an angle in degrees or a length in mm beyond which a curve coefficient is no longer a finding
_RESTS_ON_PRIOR = 0.2  # contraction below which a parameter is said to rest on its prior alone


def full_text(fit: Record) -> str:
    """Everything that a fit says, for people."""
    page = summarize(fit)
    blocks = [
        _title(fit),
        _verdict(fit, page),
        parameters_text(fit),
        groups_text(fit),
        _known(fit),
        _rests_on_prior(page),
        _curves(fit, page),
    ]
    blocks += [
        _scatter(page),
        _mountings(fit, page),
        _recordings(fit),
        _measured(fit, page),
        describe_checks(checks_of(fit)),
        _friction_model(fit),
        describe_elastic(fit),
        loss_text(fit),
        _answer(fit),
    ]
    blocks.append(_origin(page))
    return "\n\n".join(block for block in blocks if block) + "\n"


def counts_in_words(fit: Record) -> str:
    """What was fitted to: '17 wrap angles and 4 efficiencies'."""
    description, tables = fit.dataset.description, fit.dataset.measurements
    entered = [term_kind(term.name).count_readings(term, description) for term in fit.model.terms]
    read = [kind.count_readings(table) for kind, table in each_table(tables)]
    return listed([count for count in (*entered, *read) if count])


def fitted_to(fit: Record) -> str:
    """What was fitted to, and by which model where it is not the usual one, in a sentence."""
    description = fit.dataset.description
    geometry = f"; {description.geometry} geometry" if description.curved else ""
    model = f"; friction model {description.friction_model}" if description.friction_model != "capstan" else ""
    laws = f"; {description.laws_in_words}" if description.laws_in_words else ""
    noise = f"; {description.noise_in_words}" if description.noise != "normal" else ""
    return f"Fitted to {counts_in_words(fit)}{geometry}{laws}{model}{noise}."


def _title(fit: Record) -> str:
    remarks = [filled(remark) for remark in fit.dataset.measurements.remarks]
    return "\n".join([fit.name, "=" * len(fit.name), filled(fitted_to(fit)), *remarks])


def _verdict(fit: Record, page: dict[str, Any]) -> str:
    found = verdict(fit)
    if fit.sampled is None:
        state = "least squares only; no posterior, no design answer" if found.trusted else _untrusted(found)
    else:
        state = "converged" if found.trusted else _untrusted(found)
        sampler = page["sampler"]
        state += f" ({sampler_text(sampler)})"
    lines = [f"Verdict: {state}."]
    lines += [filled(f"- {reason}", indent="  ") for reason in found.reasons]
    lines += [filled(sentence) for sentence in sampler_sentences(page)]
    if NOT_IDENTIFIABLE not in found.troubles:  # which says so of the same parameters
        lines += [filled(c.sentence()) for c in confounded_pairs(fit)]
    return "\n".join(lines)


def _untrusted(found: Verdict) -> str:
    """What is wrong, in capitals that nobody overlooks."""
    kinds = {
        NOT_IDENTIFIABLE: "COEFFICIENTS NOT IDENTIFIABLE",
        CONTRADICTORY: "CONTRADICTORY MEASUREMENTS",
        IMPOSSIBLE: "IMPOSSIBLE READINGS",
        COPIED: "COPIED READINGS",
        COARSE: "READINGS TOO COARSE",
        NOT_DESCRIBED: "THE MODEL DOES NOT DESCRIBE THESE READINGS",
    }
    if NOT_CONVERGED in found.troubles:
        return "NOT CONVERGED; do not use these numbers"
    return f"{listed([kinds[kind] for kind in found.troubles])}; do not use these numbers before reading why"


def _known(fit: Record) -> str:
    """Which coefficients the measurements determine, in a sentence."""
    friction = identifiability(fit).groups.get("friction") if fit.sampled is not None else None
    return filled(say_what_is_determined(friction, measured=True)) if friction is not None else ""


def _rests_on_prior(page: dict[str, Any]) -> str:
    names = [
        n
        for n, p in page["parameters"].items()
        if p.get("contraction") is not None and p["contraction"] < _RESTS_ON_PRIOR
    ]
    if not names:
        return ""
    verb = "rests" if len(names) == 1 else "rest"
    return filled(f"Hardly informed by the measurements: {listed(names)} {verb} on the prior almost alone.")


def _curves(fit: Record, page: dict[str, Any]) -> str:
    """Derived quantities of the curves, a table for each family."""
    if fit.sampled is None:
        return ""
    families: dict[type[Curve], list[str]] = {}
    for curve in fit.model.cable.curves.values():
        families.setdefault(type(curve), []).extend(curve.derived_units())
    return "\n\n".join(_family(family, names, page["curves"]) for family, names in families.items() if names)


def _family(family: type[Curve], names: list[str], page: dict[str, Any]) -> str:
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


def _scatter(page: dict[str, Any]) -> str:
    found = [(readings_called(name), sd) for name, sd in page["least_squares"]["residual_sd"].items() if sd is not None]
    parts = [
        f"{called.name.replace('_', ' ')} {called.shown_scale * sd:.2f} {called.scatter_unit}"
        for called, sd in found
        if called.scatter_unit
    ]
    return filled(f"Residual standard deviation of least squares: {listed(parts)}.") if parts else ""


def _mountings(fit: Record, page: dict[str, Any]) -> str:
    """The scatter from mounting to mounting, in words."""
    tau, runs = (
        page["parameters"].get(RUN_SCATTER, {}),
        {r["label"] for r in page["measured"] if readings_called(r["table"]).are_runs},
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
        f"{high} %). All samples of a run share what its mounting did, so longer runs do not make the coefficients surer; "
        f"more runs do.{heavy}"
    )


def _recordings(fit: Record) -> str:
    recordings = fit.dataset.measurements.table(Recordings)
    return "Recordings\n" + "\n".join(recordings_text(recordings)) if recordings is not None else ""


def _friction_model(fit: Record) -> str:
    """What the options of the friction model found."""
    friction = fit.model.cable.friction
    if not friction.options:
        return ""
    conditions, lines = friction.conditions, []
    if friction.depends_on_load:
        lines.append(
            f"Coefficients, efficiency curves and the best length are stated for an input force of "
            f"{conditions.reference_force:g} N, because friction depends on the load; measured efficiencies hold at the force "
            "that stands beside them."
        )
        lost = lost_force(fit)
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
    effect = rate_effect(fit)
    if effect is not None:
        lines.append(effect.sentence())
    if (falls := stick_slip(fit)) is not None:
        lines.append(falls.sentence())
    return "\n".join(filled(line) for line in lines)


def _measured(fit: Record, page: dict[str, Any]) -> str:
    if not page["measured"]:
        return ""
    drawn = fit.sampled is not None
    of_load = ["at input"] if any("input_force_N" in row for row in page["measured"]) else []
    heads = ["measured at", *of_load, "measured", "predicted", *(["90 % interval"] if drawn else [])]
    heads += ["measured/predicted - 1"]
    rows = []
    for row in page["measured"]:
        interval = [f"{percent(row['q05'], 2)} to {percent(row['q95'], 2)}"] if drawn else []
        what = "run " if readings_called(row["table"]).are_runs else ""
        rows.append(
            [
                what + row["label"],
                *([f"{significant(row['input_force_N'])} N"] if of_load else []),
                percent(row["measured"], 2),
                percent(row["predicted"], 2),
                *interval,
                percent(row["relative_error"], 2, "+"),
            ]
        )
    return "Efficiency, measured and predicted\n" + table(heads, rows)


def _answer(fit: Record) -> str:
    if fit.sampled is None or fit.dataset.description.route is None:
        return ""
    return str(fit.optimal_length())


def _origin(page: dict[str, Any]) -> str:
    versions = ", ".join(f"{name} {version}" for name, version in page["versions"].items())
    return filled(f"Seed {page['seed']}; {versions}.")
