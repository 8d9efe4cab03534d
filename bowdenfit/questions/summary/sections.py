"""The answer and whether to trust it, at the top of the report."""

from pathlib import Path

import numpy as np

from bowdenfit.kinds import iterate_tables
from bowdenfit.pages.section import PageSection, PageTable, prose_section
from bowdenfit.questions.check.answer import check_readings
from bowdenfit.questions.check.words import describe_checks
from bowdenfit.questions.error_budget import bench_sentences, find_optimal_length
from bowdenfit.questions.groups import groups_text
from bowdenfit.questions.next.words import TITLE
from bowdenfit.questions.summary.brief import (
    READING_HEADS,
    format_reading,
    key_quantities,
    say_no_outliers,
    summary_sentences,
)
from bowdenfit.questions.summary.details import details_text, parameters_text
from bowdenfit.questions.summary.methods import describe_fitted_data
from bowdenfit.questions.summary.verdict import (
    assess_fit,
    collect_checked_readings,
    distrust_warning,
    find_outliers,
    interval_width_caveat,
    reasons_against,
    reasons_to_trust,
    suggest_next_step,
)
from bowdenfit.results.record import Record
from bowdenfit.words import counted, listed

_HEADS = ("coefficient", "value", "90 % interval", "unit", "what it is")
_MOST_CORRELATED = 30  # parameters in a table of correlations
_MOST_READINGS = 400  # readings in a table that someone may look through


def answer_section(fit: Record) -> PageSection:
    """Return what to do or what the coefficients are; of a fit that is not to be trusted that first, and why."""
    fit_verdict, (first, *others) = assess_fit(fit), summary_sentences(fit)
    choices: tuple[PageTable, ...] = ()
    if fit.sampled is not None and fit.dataset.description.route is not None:
        best = find_optimal_length(fit)
        choices = (PageTable(best.heads, tuple(best.rows), "Lengths that can be bought"),) if best.choices else ()
    context = {
        "trusted": fit_verdict.trusted,
        "doubtful": bool(fit_verdict.doubts) or not (fit_verdict.sampled and fit_verdict.may_be_used_for("design")),
        "first": first,
        "others": [*others, *bench_sentences(fit)],
        "warning": distrust_warning(fit_verdict),
        "why": [reason for reason in (*reasons_to_trust(fit), interval_width_caveat(fit)) if reason]
        if fit_verdict.trusted
        else reasons_against(fit_verdict),
        "choices": choices,
    }
    return PageSection("The answer", Path(__file__).with_name("answer.html"), context)


def measured_section(fit: Record) -> PageSection:
    """Return every table, as `bowdenfit check` describes it."""
    data = fit.dataset
    described = [(kind, kind.describe(table, data.description)) for kind, table in iterate_tables(data.measurements)]
    items = [line for kind, lines in described if not kind.heading for line in lines]
    longer = [(kind.heading, "\n".join(lines)) for kind, lines in described if kind.heading]
    return prose_section(
        "What was measured", [describe_fitted_data(fit), *data.measurements.remarks], items=items, folded=longer
    )


def coefficients_section(fit: Record) -> PageSection | None:
    """Return the coefficients of friction and of the rope; None where every one is stated."""
    rows = tuple((q.name, q.value, q.interval, q.unit, q.description) for q in key_quantities(fit))
    folded: list[tuple[str, str | PageTable]] = [
        ("Every parameter, with what was assumed beforehand", parameters_text(fit)),
        ("Groups", groups_text(fit)),
    ]
    if fit.sampled is not None:
        folded.append(("Correlations of all parameters", _correlation_table(fit)))
    return prose_section("Coefficients", (), [PageTable(_HEADS, rows, left=(0, 3, 4))], folded=folded) if rows else None


def _correlation_table(fit: Record) -> PageTable:
    """Return the correlations of the draws of all parameters, below the diagonal."""
    draws = fit.posterior.values
    names = [p.name for p in fit.model.space.free][:_MOST_CORRELATED]
    matrix = np.atleast_2d(np.corrcoef([draws[name].ravel() for name in names]))
    rows = tuple(
        (name, *(f"{matrix[i, k]:z.2f}" for k in range(i)), "1", *([""] * (len(names) - i - 1))) for i, name in enumerate(names)
    )
    caption = "Close to 1 or -1: the readings determine a combination of the two, and barely either alone."
    return PageTable(("", *names), rows, caption)


def checks_section(fit: Record) -> PageSection | None:
    """Return the outliers; folded, all readings and what the checks say in full. None without draws."""
    outliers, readings = find_outliers(fit), collect_checked_readings(fit)
    if not readings:
        return None
    heads = ("reading", *READING_HEADS)
    caption = f"Outliers: {len(outliers)} of {counted(len(readings), 'reading')}"
    outlier_table = PageTable(heads, tuple(map(format_reading, outliers)), caption)
    all_readings = PageTable(heads, tuple(map(format_reading, readings[:_MOST_READINGS])))
    heading = "All readings" if len(readings) <= _MOST_READINGS else f"The first {_MOST_READINGS} of {len(readings)} readings"
    folded: list[tuple[str, str | PageTable]] = [
        (f"{heading} next to the prediction from all the others (leave-one-out)", all_readings),
        ("The leave-one-out checks, with their numbers", describe_checks(check_readings(fit))),
    ]
    return prose_section("Checks", [say_no_outliers(readings) if not outliers else ""], [outlier_table], folded=folded)


def next_step_section(fit: Record) -> PageSection | None:
    """Return the next step with a fit that may be trusted; of another the reasons say it."""
    sentence = suggest_next_step(fit) if assess_fit(fit).trusted else ""
    return prose_section(TITLE, [sentence]) if sentence else None


def provenance_section(fit: Record) -> PageSection:
    """Return what it takes to make the same fit again."""
    made, files = fit.provenance, fit.dataset.sha256
    versions = ", ".join(f"{name} {version}" for name, version in made.versions.items())
    when = f", finished {made.created}" if made.created else ""
    start = listed([f"{name} = {value:.6g}" for name, value in made.start.items()])
    when += f"; the search began at {start} too" if start else ""
    return prose_section(
        "Where the numbers come from",
        [f"Seed {made.seed}{when}. The same files, versions and seed give the same numbers.", f"{versions}."],
        [PageTable(("input file", "SHA-256"), tuple(files.items()), left=(0, 1))],
        folded=[("Everything that the fit says", details_text(fit))],
    )
