"""A certificate as a page to print on A4 and sign; it stands alone, without a script."""

from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np

from bowdenfit.addons.certificate.answer import Certificate, CertifiedQuantity
from bowdenfit.addons.certificate.conformity import DECISION_WORDS
from bowdenfit.addons.certificate.laboratory import Party
from bowdenfit.addons.certificate.wording import (
    describe_degrees,
    describe_limits,
    describe_probability,
    describe_risks,
    describe_rule,
)
from bowdenfit.kinds import find_readings
from bowdenfit.kinds.terms import find_term_kind
from bowdenfit.pages.section import HtmlPage, PageSection, PageTable
from bowdenfit.questions.summary.sections import measured_section
from bowdenfit.results.record import Record
from bowdenfit.words import capitalized, counted, decimals, listed

_UNTRACED = (
    "No certificate of a load cell is stated. Forces of this certificate are not shown to be traceable to the SI; their "
    "errors are those that the fit assumed."
)
_RESULTS = (
    "Expanded uncertainties U have a coverage probability of {}. Values and uncertainties are those of JCGM 101:2008 "
    "(Monte Carlo): u is the standard deviation of the draws, U half of their probabilistically symmetric interval, and "
    "k = U / u, which is no quantile of a t distribution. Where an interval is not symmetric about the value, its ends "
    "count."
)
_BUDGET = (
    "Components combine as in JCGM 100:2008: the root of the sum of squares, effective degrees of freedom by Welch and "
    "Satterthwaite (G.4.1), and k of a t distribution (G.3.2). Type A is the t distribution with the 50 % and 95 % "
    "intervals of the posterior; limits of type B count as known. Where the two differ, JCGM 101 counts (its clause 8): "
    "Welch and Satterthwaite are approximate for few degrees of freedom."
)


def certificate_page(fit: Record, certificate: Certificate) -> HtmlPage:
    """Return the page of a certificate.

    Args:
        fit: The fit.
        certificate: Its certificate.
    """
    lab = certificate.laboratory
    signatures = [(signature.name or "Name and signature", signature.role) for signature in lab.signature]
    sections = [
        _parties_section(certificate),
        _results_section(certificate),
        _conformity_section(certificate),
        _budget_section(certificate),
        _measured_section(fit, certificate),
        _cells_section(certificate),
        _provenance_section(fit, certificate),
        _section("Signatures", signatures=[(f"{lab.laboratory.city}, {lab.issued}", "Place and date"), *signatures]),
    ]
    subtitle = f"{lab.item.name}, serial number {lab.item.serial}; issued {lab.issued} by {lab.laboratory.name}"
    title = f"Calibration certificate {lab.number}"
    return HtmlPage(title, subtitle, tuple(section for section in sections if section is not None))


def _section(
    title: str,
    tables: Iterable[PageTable] = (),
    facts: Iterable[tuple[str, str]] = (),
    notes: Iterable[str] = (),
    signatures: Iterable[tuple[str, str]] = (),
) -> PageSection:
    """Return a section: tables, facts under their names, paragraphs below, and blanks for signatures."""
    context = {
        "facts": [(name, text) for name, text in facts if text],
        "notes": tuple(notes),
        "signatures": tuple(signatures),
    }
    return PageSection(title, Path(__file__).with_name("section.html"), {"tables": tuple(tables), **context})


def _parties_section(certificate: Certificate) -> PageSection:
    lab = certificate.laboratory
    item = [lab.item.name, f"serial number {lab.item.serial}", lab.item.manufacturer, lab.item.model]
    facts = [
        ("Item", ", ".join(filter(None, item))),
        ("Laboratory", _describe_party(lab.laboratory)),
        ("Customer", _describe_party(lab.customer)),
    ]
    return _section("Item, laboratory, customer", facts=facts)


def _describe_party(party: Party) -> str:
    accredited = f"accreditation {party.accreditation}" if party.accreditation is not None else ""
    address = [party.name, party.street, f"{party.post_code} {party.city}", party.country, party.email, accredited]
    return ", ".join(filter(None, address))


def _results_section(certificate: Certificate) -> PageSection:
    level = f"{100 * certificate.quantities[0].probability:g} %"
    heads = ("quantity", "value", "u", "U", "k", "effective degrees of freedom", f"{level} interval", "what it is")
    table = PageTable(heads, tuple(map(_result_row, certificate.quantities)), left=(0, 7))
    return _section("Results", [table], notes=[_RESULTS.format(level), *certificate.remarks])


def _result_row(quantity: CertifiedQuantity) -> tuple[str, ...]:
    digits = quantity.digits
    name = quantity.name if quantity.unit == "1" else f"{quantity.name} ({quantity.unit})"
    numbers = (quantity.value, quantity.standard, quantity.expanded)
    low, high = quantity.interval
    return (
        name,
        *(f"{number:z.{digits}f}" for number in numbers),
        f"{quantity.factor:.2f}",
        describe_degrees(quantity.degrees),
        f"{low:z.{digits}f} to {high:z.{digits}f}",
        quantity.meaning,
    )


def _conformity_section(certificate: Certificate) -> PageSection | None:
    if not certificate.statements:
        return None
    heads = ("quantity", "limit", "value", "decision", "probability of conformity")
    rows, facts = [], []
    for statement in certificate.statements:
        quantity = certificate.quantity(statement.quantity)
        limits = describe_limits(statement, quantity)
        value = f"{quantity.in_unit(quantity.value)} ± {quantity.in_unit(quantity.expanded)}"
        decision = f"{statement.decision}: {DECISION_WORDS[statement.decision]}"
        rows.append((quantity.name, limits, value, decision, describe_probability(statement.probability)))
        source = f" Limit from: {statement.source}." if statement.source else ""
        facts.append((quantity.name, f"{describe_rule(statement, quantity)}. {describe_risks(statement)}{source}"))
    note = "Decision rules and risks are those of JCGM 106:2012 (ISO/IEC Guide 98-4)."
    return _section("Conformity", [PageTable(heads, tuple(rows), left=(0, 1, 3))], facts, [note])


def _budget_section(certificate: Certificate) -> PageSection:
    quantities = certificate.quantities
    names = list(dict.fromkeys((c.name, c.evaluation) for quantity in quantities for c in quantity.budget))
    rows = []
    for name, evaluation in names:
        cells = []
        for quantity in quantities:
            component = next((c for c in quantity.budget if c.name == name), None)
            cells.append("-" if component is None else _two_digits(component.standard))
        rows.append((capitalized(name), evaluation, *cells))
    sums: tuple[tuple[str, Callable[[CertifiedQuantity], str]], ...] = (
        ("Degrees of freedom of type A", lambda q: describe_degrees(q.budget[0].degrees)),
        ("Combined, JCGM 100", lambda q: _two_digits(q.gum_standard)),
        ("Effective degrees of freedom", lambda q: describe_degrees(q.degrees)),
        ("k and U, JCGM 100", lambda q: f"{q.gum_factor:.2f}, {q.gum_factor * q.gum_standard:z.{q.digits}f}"),
        ("k and U, JCGM 101 (stated)", lambda q: f"{q.factor:.2f}, {q.expanded:z.{q.digits}f}"),
    )
    rows += [(title, "", *map(describe, quantities)) for title, describe in sums]
    heads = ("standard uncertainty from", "type", *(quantity.name.replace("_", " ") for quantity in quantities))
    return _section("Uncertainty budget", [PageTable(heads, tuple(rows), left=(0, 1))], notes=[_BUDGET])


def _two_digits(number: float) -> str:
    return f"{number:.{decimals(number)}f}"


def _measured_section(fit: Record, certificate: Certificate) -> PageSection:
    conditions, description, tables = (
        certificate.laboratory.measured,
        fit.dataset.description,
        fit.dataset.measurements.tables,
    )
    section = measured_section(fit)
    showing = [term for term in fit.model.terms if find_term_kind(term.name).shows_mounting_scatter]
    runs = sum(len(term.labels) for term in showing if find_readings(term.name).are_runs)
    readings = sum(len(term.labels) for term in showing if not find_readings(term.name).are_runs)
    counts = [counted(n, noun) for n, noun in ((runs, "run"), (readings, "single reading")) if n]
    lengths = _range_of(tables, "route", description.route.unit if description.route is not None else "")
    loads = _range_of(tables, "input_force", "N") or _range_of(tables, "load", "N")
    period = (
        conditions.begin.isoformat()
        if conditions.begin == conditions.end
        else f"{conditions.begin.isoformat()} to {conditions.end.isoformat()}"
    )
    rows = [
        ("Data set", f"{fit.name}. {section.context['sentences'][0]}"),
        ("Tables", "; ".join(line.removesuffix(".") for line in section.context["items"])),
        ("Mountings", f"{listed(counts)}, each a mounting of its own" if counts else ""),
        ("Lengths", lengths),
        ("Loads at the input", loads),
        ("Bench", conditions.bench),
        ("Method", conditions.method),
        ("Measured", period + (f", {conditions.operator}" if conditions.operator is not None else "")),
        ("Air temperature", _describe_range(conditions.temperature_degC, "°C")),
        ("Relative humidity", _describe_range(conditions.humidity_percent, "%")),
    ]
    return _section("What was measured, and how", facts=rows)


def _describe_range(ends: tuple[float, float] | None, unit: str) -> str:
    return f"{ends[0]:g} to {ends[1]:g} {unit}" if ends is not None else "not stated"


def _range_of(tables: tuple[object, ...], name: str, unit: str) -> str:
    """Return the range of a column over all tables that have it; empty without any number in it."""
    columns = [np.ravel(getattr(table, name)) for table in tables if getattr(table, name, None) is not None]
    numbers = np.concatenate(columns) if columns else np.empty(0)
    different = np.unique(numbers[np.isfinite(numbers)])
    if not len(different):
        return ""
    ends = f"{different[0]:.4g} to {different[-1]:.4g} {unit}, {len(different)} different"
    return ends if len(different) > 1 else f"{different[0]:.4g} {unit}"


def _cells_section(certificate: Certificate) -> PageSection:
    heads = ("load cell", "end", "certificate", "issued", "by", "U, relative", "k")
    rows = []
    for entry, cell in certificate.cells:
        expanded = f"{100 * cell.gain_error_sd * cell.coverage_factor:.2g} %"
        rows.append(
            (entry.cell, entry.end, cell.number, cell.issued, cell.issued_by, expanded, f"{cell.coverage_factor:g}")
        )
    tables = [PageTable(heads, tuple(rows), left=(0, 1, 4))] if rows else []
    return _section("Traceability", tables, notes=() if rows else [_UNTRACED])


def _provenance_section(fit: Record, certificate: Certificate) -> PageSection:
    made, names = fit.provenance, {quantity.name for quantity in certificate.quantities}
    facts = [
        ("Computed by", ", ".join(f"{name} {version}" for name, version in made.versions.items())),
        ("Seed", f"{made.seed}; the same files, versions and seed give the same numbers"),
        ("Priors", "; ".join(f"{p.name} {p.prior_text}" for p in fit.model.space.free if p.name in names)),
        *((name, f"SHA-256 {digest}") for name, digest in fit.dataset.sha256.items()),
    ]
    note = (
        f"The digital certificate {certificate.laboratory.number} (XML) states the same results. They are those of the "
        "item as it was measured; this certificate may be copied only as a whole."
    )
    return _section("Where the numbers come from", facts=facts, notes=[note])
