"""What the digital certificate of a load cell says about its gain, and what to write into `cable.toml`.

A certificate lists forces of the standard (`basic_referenceValue`) and what the cell showed (`basic_measuredValue`, or its
error, `basic_measurementError`), with expanded uncertainties. The gain is the slope through zero of shown over true force, and
its standard uncertainty the largest relative one of the forces in the upper four fifths of the range.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal
from xml.etree.ElementTree import Element

import numpy as np

from bowdenfit.addons.certificate.safe_xml import DCC, SI, parse_certificate
from bowdenfit.display import Display, Rows
from bowdenfit.errors import DatasetError
from bowdenfit.types import Vector
from bowdenfit.words import printable, shown

NEWTONS = {r"\newton": 1.0, r"\milli\newton": 1e-3, r"\kilo\newton": 1e3, r"\mega\newton": 1e6}
REFERENCE, MEASURED, ERROR = "basic_referenceValue", "basic_measuredValue", "basic_measurementError"
_LEAST_SHARE = 0.2  # of the largest force, from which on relative uncertainties count; a judgement
_NAMES = {"dcc": DCC, "si": SI}
# Where D-SI has numbers: single ones and lists, of versions 2.0 and 2.1, and of 2.2 (expandedMU).
_VALUES = ("si:real/si:value", "si:realListXMLList/si:valueXMLList")
_UNITS = ("si:real/si:unit", "si:realListXMLList/si:unitXMLList")
_EXPANDED = (
    "si:real/si:expandedUnc/si:uncertainty",
    "si:realListXMLList/si:expandedUncXMLList/si:uncertaintyXMLList",
    "si:real/si:measurementUncertaintyUnivariate/si:expandedMU/si:valueExpandedMU",
    "si:realListXMLList/si:measurementUncertaintyUnivariateXMLList/si:expandedMUXMLList/si:valueExpandedMUXMLList",
)
_FACTORS = (".//si:coverageFactor", ".//si:coverageFactorXMLList")
_SHORTENED = ("a list that was shortened by hand", "ask the laboratory for the original")
_OTHER_UNITS = ("lists in different units", "ask the laboratory which unit each list has")


@dataclass(frozen=True, repr=False)
class CalibratedCell(Display):
    """A load cell by its certificate.

    Args:
        number: Number of the certificate.
        issued: When it was issued, or calibration ended.
        issued_by: Laboratory that calibrated the cell.
        gain_error_sd: Relative standard uncertainty of its gain [1].
        coverage_factor: Coverage factor of the certificate.
        gain: Force that the cell shows over the true force [1].
        end: End of the cable at which it is.
    """

    number: str
    issued: str
    issued_by: str
    gain_error_sd: float
    coverage_factor: float
    gain: float = 1.0
    end: Literal["input", "output"] = "input"

    @property
    def toml(self) -> str:
        """What to write under [sensors] of cable.toml."""
        ratio = (
            [f"{self.end}_ratio = {1 / self.gain:.6g}  # true force over shown force"]
            if abs(self.gain - 1) > 5e-7
            else []
        )
        sd = f"{self.end}_gain_error_sd = {self.gain_error_sd:.3g}  # certificate {self.number}, {self.issued}"
        return "\n".join(["[sensors]", *ratio, sd])

    def sentences(self) -> list[str]:
        """Return what the certificate says."""
        return [
            f"Certificate {self.number} of {self.issued_by}, {self.issued}: gain {self.gain:.6g} with a relative standard "
            f"uncertainty of {100 * self.gain_error_sd:.2g} %."
        ]

    def _table(self) -> Rows:
        return [vars(self)], {}


@dataclass(frozen=True)
class _Forces:
    """Forces of one quantity of a certificate, and their standard uncertainties [N]; NaN where none is stated."""

    values: Vector
    standard: Vector
    coverage_factor: float

    @property
    def has_uncertainty(self) -> bool:
        """Whether its uncertainty is stated."""
        return bool(np.isfinite(self.standard).all())


def read_load_cell(path: str | Path, end: Literal["input", "output"] = "input") -> CalibratedCell:
    """Read the digital certificate of a load cell.

    Args:
        path: A PTB Digital Calibration Certificate, XML.
        end: End of the cable at which the cell is.

    Raises:
        DatasetError: It is no such certificate, or does not say how large the error of the gain is; names the element.
    """
    path = Path(path)
    root = parse_certificate(path)
    reference, measured, error = (_read_forces(root, kind, path.name) for kind in (REFERENCE, MEASURED, ERROR))
    if reference is None or (measured is None and error is None):
        missing = REFERENCE if reference is None else f"{MEASURED} or {ERROR}"
        raise _refusal(
            f"{path.name}, dcc:quantity with refType {missing}",
            "no force in newton has it",
            "a certificate of another kind of instrument, or from before refTypes were agreed",
            "read the gain error from the PDF, and write input_gain_error_sd by hand",
        )
    readings = measured or error
    assert readings is not None
    if len(readings.values) != len(reference.values):
        counts = f"{len(readings.values)} forces of the cell stand against {len(reference.values)} of the standard"
        raise _refusal(f"{path.name}, dcc:quantity with refType {MEASURED}", counts, *_SHORTENED)
    shown_force = readings.values if measured is not None else reference.values + readings.values
    uncertain = next((forces for forces in (measured, error) if forces is not None and forces.has_uncertainty), None)
    if uncertain is None:
        raise _refusal(
            f"{path.name}, si:expandedUnc of {MEASURED}",
            "no expanded uncertainty is stated",
            "uncertainties that only the PDF has",
            "write input_gain_error_sd by hand: U / k over the force",
        )
    gain, relative = _fit_gain(reference.values, shown_force, uncertain.standard)
    if not (0.5 < gain < 2 and relative < 1):
        wrong = f"shown over true force is {gain:.3g}, with an uncertainty of {100 * relative:.3g} %"
        raise _refusal(f"{path.name}, dcc:quantity with refType {MEASURED}", wrong, *_OTHER_UNITS)
    return CalibratedCell(*_read_identity(root), relative, uncertain.coverage_factor, gain, end)


def _fit_gain(reference: Vector, shown_force: Vector, standard: Vector) -> tuple[float, float]:
    """Return the slope through zero of shown over true force, and its largest relative standard uncertainty [1]."""
    largest = float(np.max(np.abs(reference)))
    if len(standard) != len(reference) or largest == 0:
        return np.nan, np.nan
    usable = np.abs(reference) >= _LEAST_SHARE * largest
    gain = float(np.sum(shown_force * reference) / np.sum(reference**2))
    return gain, float(np.max(standard[usable] / np.abs(reference[usable])))


def _read_identity(root: Element) -> tuple[str, str, str]:
    """Return number, date and laboratory of a certificate."""
    core = "dcc:administrativeData/dcc:coreData/dcc:"
    issued = _text(root, f"{core}issueDate") or _text(root, f"{core}endPerformanceDate")
    issuer = _text(root, "dcc:administrativeData/dcc:calibrationLaboratory/dcc:contact/dcc:name/dcc:content")
    return _text(root, f"{core}uniqueIdentifier"), issued, issuer


def _read_forces(root: Element, kind: str, name: str) -> _Forces | None:
    """Return the first quantity of a kind that is a force; None where there is none."""
    for quantity in root.iterfind(".//dcc:quantity", _NAMES):
        unit = next((text for path in _UNITS if (text := _text(quantity, path))), "").split()
        if kind not in quantity.get("refType", "").split() or not unit or any(part not in NEWTONS for part in unit):
            continue
        values = _read_numbers(quantity, _VALUES, name)
        expanded, factors = (_read_numbers(quantity, paths, name) for paths in (_EXPANDED, _FACTORS))
        fitting = {1, len(values)}
        if not len(values) or not {len(unit), len(expanded) or 1, len(factors) or 1} <= fitting:
            wrong = f"{len(values)} values, {len(unit)} units, {len(expanded)} uncertainties, {len(factors)} coverage factors"
            raise _refusal(f"{name}, dcc:quantity with refType {kind}", wrong, *_SHORTENED)
        if (factors <= 0).any() or (expanded < 0).any():
            wrong = "an uncertainty is negative, or a coverage factor not above 0"
            raise _refusal(
                f"{name}, dcc:quantity with refType {kind}", wrong, "a mistyped number", "ask the laboratory"
            )
        newtons = np.array([NEWTONS[part] for part in unit])
        has_both = len(expanded) and len(factors)
        standard = (
            np.broadcast_to(expanded / factors * newtons, len(values)) if has_both else np.full(len(values), np.nan)
        )
        return _Forces(values * newtons, standard, float(factors[0]) if has_both else np.nan)
    return None


def _read_numbers(quantity: Element, paths: tuple[str, ...], name: str) -> Vector:
    """Return the numbers at the first of some paths that has any; none without."""
    path, text = next(((path, text) for path in paths if (text := _text(quantity, path))), ("", ""))
    try:
        numbers = np.array([float(part) for part in text.split()])
    except ValueError:
        numbers = np.array([np.nan])
    if not np.isfinite(numbers).all():
        element = path.rpartition("/")[2]
        raise _refusal(
            f"{name}, {element}", f"{shown(text)} must be numbers", "a decimal comma or an empty cell", "correct it"
        )
    return numbers


def _text(element: Element, path: str) -> str:
    """Return the text at a path on one line, without what cannot be printed; empty where there is none."""
    return printable(" ".join((element.findtext(path, "", _NAMES) or "").split()))


def _refusal(place: str, fault: str, cause: str, fix: str) -> DatasetError:
    return DatasetError(f"{place}: {fault}; the usual cause is {cause}: {fix}.")
