"""A certificate as a PTB Digital Calibration Certificate: XML of the schema DCC 3.2.1, with numbers and units of D-SI 2.1.0.

The schemas are PTB's (https://www.ptb.de/dcc, https://www.ptb.de/si) and no part of this package.
"""

import math
import re
from datetime import date
from xml.etree.ElementTree import Element, SubElement, indent, register_namespace, tostring

from bowdenfit.addons.certificate.answer import Certificate, CertifiedQuantity
from bowdenfit.addons.certificate.conformity import DECISION_WORDS, ConformityStatement
from bowdenfit.addons.certificate.laboratory import MeasuringConditions, Party
from bowdenfit.addons.certificate.safe_xml import DCC, ROOT, SI
from bowdenfit.addons.certificate.wording import describe_limits, describe_risks, describe_rule
from bowdenfit.errors import UsageError
from bowdenfit.results.record import Record
from bowdenfit.units import INTERNAL_UNITS, conversion_factor, dimension_of
from bowdenfit.words import printable

SCHEMA_VERSION = "3.2.1"
UNITS = {  # of D-SI, which writes powers as \tothe
    "1": r"\one",
    "%": r"\percent",
    "N": r"\newton",
    "mm": r"\milli\metre",
    "cm": r"\centi\metre",
    "m": r"\metre",
    "deg": r"\degree",
    "rad": r"\radian",
    "s": r"\second",
    "kg": r"\kilogram",
}
_FACTOR = re.compile(r"([*/]?)([^*/^]+)(?:\^(\d))?")
METHODS = {
    "uncertainty budget": "JCGM 100:2008",
    "propagation of distributions": "JCGM 101:2008",
    "statement of conformity": "JCGM 106:2012",
}
CONFORMITY = {
    "pass": "pass",
    "conditional pass": "conditionalPass",
    "conditional fail": "conditionalFail",
    "fail": "fail",
}
CELSIUS, PERCENT = r"\degreecelsius", r"\percent"


def certificate_xml(fit: Record, certificate: Certificate) -> bytes:
    """Return a certificate as XML.

    Args:
        fit: The fit.
        certificate: Its certificate.

    Raises:
        UsageError: A quantity has a unit that D-SI does not have.
    """
    register_namespace("dcc", DCC)
    register_namespace("si", SI)
    root = Element(ROOT, {"schemaVersion": SCHEMA_VERSION})
    _add_administration(SubElement(root, f"{{{DCC}}}administrativeData"), fit, certificate)
    _add_results(_add(root, "measurementResults"), fit, certificate)
    indent(root)
    return tostring(root, encoding="utf-8", xml_declaration=True) + b"\n"


def _add(parent: Element, name: str, text: str | float | date | None = None, **attributes: str) -> Element:
    """Add an element of the DCC, with a text that XML can hold; return it."""
    element = SubElement(parent, f"{{{DCC}}}{name}", attributes)
    if text is not None:
        element.text = printable(str(text))
    return element


def _add_text(parent: Element, name: str, text: str) -> Element:
    """Add an element with a text in English; return it."""
    element = _add(parent, name)
    _add(element, "content", text, lang="en")
    return element


def _add_administration(parent: Element, fit: Record, certificate: Certificate) -> None:
    laboratory_file, version = certificate.laboratory, fit.provenance.versions.get("bowdenfit", "unknown")
    software = _add(_add(parent, "dccSoftware"), "software")
    _add_text(software, "name", "bowdenfit")
    _add(software, "release", version)
    core = _add(parent, "coreData")
    _add(core, "countryCodeISO3166_1", laboratory_file.laboratory.country)
    _add(core, "usedLangCodeISO639_1", "en")
    _add(core, "mandatoryLangCodeISO639_1", "en")
    _add(core, "uniqueIdentifier", laboratory_file.number)
    _add(core, "beginPerformanceDate", laboratory_file.measured.begin)
    _add(core, "endPerformanceDate", laboratory_file.measured.end)
    _add(core, "performanceLocation", "laboratory")
    _add(core, "issueDate", laboratory_file.issued)
    item = _add(_add(parent, "items"), "item")
    _add_text(item, "name", laboratory_file.item.name)
    if laboratory_file.item.manufacturer is not None:
        _add_text(_add(item, "manufacturer"), "name", laboratory_file.item.manufacturer)
    if laboratory_file.item.model is not None:
        _add(item, "model", laboratory_file.item.model)
    identification = _add(_add(item, "identifications"), "identification")
    _add(identification, "issuer", "manufacturer")
    _add(identification, "value", laboratory_file.item.serial)
    laboratory = _add(parent, "calibrationLaboratory")
    if laboratory_file.laboratory.accreditation is not None:
        _add(laboratory, "calibrationLaboratoryCode", laboratory_file.laboratory.accreditation)
    _add_contact(laboratory, "contact", laboratory_file.laboratory)
    persons = _add(parent, "respPersons")
    for number, signature in enumerate(laboratory_file.signature):
        person = _add(persons, "respPerson")
        _add_text(_add(person, "person"), "name", signature.name or signature.role)
        _add(person, "role", signature.role)
        _add(person, "mainSigner", "true" if number == 0 else "false")
    _add_contact(parent, "customer", laboratory_file.customer)
    statements = _add(parent, "statements")
    for statement in certificate.statements:
        _add_conformity(statements, statement, certificate.quantity(statement.quantity))
    for remark in certificate.remarks:
        _add_text(_add(statements, "statement"), "declaration", remark)


def _add_contact(parent: Element, name: str, party: Party) -> None:
    contact = _add(parent, name)
    _add_text(contact, "name", party.name)
    if party.email is not None:
        _add(contact, "eMail", party.email)
    location = _add(contact, "location")
    for key, value in (("street", party.street), ("postCode", party.post_code), ("city", party.city)):
        _add(location, key, value)
    _add(location, "countryCode", party.country)


def _add_conformity(parent: Element, statement: ConformityStatement, quantity: CertifiedQuantity) -> None:
    element = _add(parent, "statement", refType="basic_conformity")
    _add_text(element, "name", f"{quantity.name} {describe_limits(statement, quantity)}")
    rule, risks = describe_rule(statement, quantity), describe_risks(statement)
    _add_text(element, "description", f"The item {DECISION_WORDS[statement.decision]}. {rule}. {risks}")
    _add(element, "norm", "JCGM 106:2012")
    _add(element, "conformity", CONFORMITY[statement.decision])


def _add_results(parent: Element, fit: Record, certificate: Certificate) -> None:
    conditions, result = certificate.laboratory.measured, _add(parent, "measurementResult")
    _add_text(result, "name", fit.name)
    setup = [conditions.bench, f"Operator: {conditions.operator}" if conditions.operator is not None else ""]
    if any(setup):
        _add_text(result, "description", "; ".join(filter(None, setup)))
    methods = _add(result, "usedMethods")
    for name, norm in METHODS.items():
        method = _add(methods, "usedMethod")
        _add_text(method, "name", name)
        _add(method, "norm", norm)
    if conditions.method:
        _add_text(_add(methods, "usedMethod"), "name", conditions.method)
    if certificate.cells:
        _add_cells(_add(result, "measuringEquipments"), certificate)
    if conditions.temperature_degC is not None or conditions.humidity_percent is not None:
        _add_conditions(_add(result, "influenceConditions"), conditions)
    results = _add(result, "results")
    for quantity in certificate.quantities:
        _add_result(results, quantity)
    sums = "; ".join(f"{name} {digest}" for name, digest in fit.dataset.sha256.items())
    provenance = f"Seed {fit.provenance.seed}. SHA-256 of the input files: {sums}."
    _add_text(_add(_add(result, "measurementMetaData"), "metaData"), "declaration", provenance)


def _add_cells(parent: Element, certificate: Certificate) -> None:
    for entry, cell in certificate.cells:
        equipment = _add(parent, "measuringEquipment")
        _add_text(
            equipment,
            "name",
            f"load cell at the {entry.end} end" if entry.end != "both" else "load cells of both ends",
        )
        words = (
            f"{entry.cell}: certificate {cell.number} of {cell.issued_by}, {cell.issued}; relative expanded uncertainty"
        )
        _add_text(
            equipment,
            "description",
            f"{words} {cell.gain_error_sd * cell.coverage_factor:.2g} (k = {cell.coverage_factor:g})",
        )


def _add_conditions(parent: Element, conditions: MeasuringConditions) -> None:
    for name, ends, unit in (
        ("temperature", conditions.temperature_degC, CELSIUS),
        ("humidityRelative", conditions.humidity_percent, PERCENT),
    ):
        if ends is None:
            continue
        condition = _add(parent, "influenceCondition", refType=f"basic_{name}")
        _add_text(condition, "name", "air temperature" if name == "temperature" else "relative humidity of the air")
        data = _add(condition, "data")
        for end, word in zip(ends, ("Min", "Max"), strict=True):
            _add_real(_add(data, "quantity", refType=f"basic_{name}{word}"), end, unit)


def _add_result(parent: Element, quantity: CertifiedQuantity) -> None:
    """Add a result: the value with its expanded uncertainty, its effective degrees of freedom, and its budget."""
    factor, unit = to_si(quantity.unit)
    result = _add(parent, "result")
    _add_text(result, "name", f"{quantity.name}: {quantity.meaning}")
    low, high = (quantity.in_unit(end) for end in quantity.interval)
    _add_text(result, "description", f"{100 * quantity.probability:g} % coverage interval {low} to {high}")
    data = _add(result, "data")
    value = _add(data, "quantity", refType="basic_measuredValue")
    _add_text(value, "name", quantity.meaning)
    real = _add_real(value, factor * quantity.value, unit)
    expanded = SubElement(real, f"{{{SI}}}expandedUnc")
    numbers = (factor * quantity.expanded, quantity.factor, quantity.probability)
    for key, number in zip(("uncertainty", "coverageFactor", "coverageProbability"), numbers, strict=True):
        SubElement(expanded, f"{{{SI}}}{key}").text = f"{number:.6g}"
    if math.isfinite(quantity.degrees):
        degrees = _add(data, "quantity")
        _add_text(degrees, "name", "effective degrees of freedom")
        _add_real(degrees, quantity.degrees, UNITS["1"])
    for component in quantity.budget:
        part = _add(data, "quantity")
        _add_text(part, "name", f"standard uncertainty, type {component.evaluation}: {component.name}")
        _add_real(part, factor * component.standard, unit)


def _add_real(parent: Element, number: float, unit: str) -> Element:
    """Add a number with its unit; return the element."""
    real = SubElement(parent, f"{{{SI}}}real")
    SubElement(real, f"{{{SI}}}value").text = f"{number:.9g}"
    SubElement(real, f"{{{SI}}}unit").text = unit
    return real


def to_si(unit: str) -> tuple[float, str]:
    r"""Return the factor to a unit of D-SI, and that unit, such as `\milli\metre\degree\tothe{-1}` for mm/deg.

    Args:
        unit: Unit as results show it.

    Raises:
        UsageError: D-SI has none.
    """
    factors = _FACTOR.findall(unit)
    if all(name in UNITS for _, name, _ in factors):
        parts = []
        for sign, name, power in factors:
            exponent = int(power or 1) * (-1 if sign == "/" else 1)
            if name != "1" or len(factors) == 1:
                parts.append(UNITS[name] + (f"\\tothe{{{exponent}}}" if exponent != 1 else ""))
        return 1.0, "".join(parts)
    dimension = dimension_of(unit)
    if dimension not in INTERNAL_UNITS:
        raise UsageError(
            f"the unit {unit!r} has no counterpart in D-SI here; the usual cause is a [route] in a unit of its own: write the "
            "route in mm or deg, and fit again."
        )
    return conversion_factor(unit, dimension), to_si(INTERNAL_UNITS[dimension])[1]
