"""What a laboratory states on its certificate, `laboratory.toml`: itself, the item, conditions, load cells and limits."""

import math
from datetime import date
from pathlib import Path
from typing import Annotated, Literal

from pydantic import ConfigDict, Field, ValidationError, model_validator

from bowdenfit.addons.certificate.calibrated_cell import CalibratedCell, read_load_cell
from bowdenfit.addons.certificate.conformity import ToleranceInterval
from bowdenfit.description import SCHEMA
from bowdenfit.description.values import Finite, Frozen, Name, NonNegative, Positive, Text
from bowdenfit.description.wrong_keys import explain_validation_error
from bowdenfit.errors import DescriptionError
from bowdenfit.inputs import read_toml_file

Country = Annotated[str, Field(pattern="^[A-Z]{2}$")]
Range = Annotated[tuple[Finite, Finite], Field(description="Lowest and highest value")]
_REMEDY = "name a laboratory.toml; docs/certificates.md shows one"


class Party(Frozen):
    """A laboratory or its customer."""

    name: Name
    street: Name
    city: Name
    post_code: Name
    country: Country
    email: Name | None = None
    accreditation: Name | None = None


class CalibratedItem(Frozen):
    """The cable that the certificate is about."""

    name: Name
    serial: Name
    manufacturer: Name | None = None
    model: Name | None = None


class MeasuringConditions(Frozen):
    """When, where, by whom, how and at which temperature and humidity was measured."""

    begin: date
    end: date
    operator: Name | None = None
    temperature_degC: Range | None = None  # noqa: N815  (a unit)
    humidity_percent: Range | None = None
    bench: Text = ""
    method: Text = ""

    @model_validator(mode="after")
    def _ordered(self) -> "MeasuringConditions":
        for name in ("temperature_degC", "humidity_percent"):
            if (ends := getattr(self, name)) is not None and ends[0] > ends[1]:
                raise ValueError(f"{name} = {list(ends)} must be the lowest value and the highest, in this order")
        if self.end < self.begin:
            raise ValueError(
                f"the measurements end on {self.end}, before they begin on {self.begin}; exchange the dates"
            )
        return self


class CellCertificate(Frozen):
    """Certificate of a load cell: a digital one (`dcc`, a file next to laboratory.toml), or what a printed one says."""

    end: Literal["input", "output", "both"]
    cell: Name
    dcc: Annotated[str, Field(min_length=1, max_length=4096)] | None = None
    number: Name | None = None
    issued: date | None = None
    issued_by: Name | None = None
    expanded_uncertainty: NonNegative | None = None
    coverage_factor: Positive = 2.0

    @model_validator(mode="after")
    def _complete(self) -> "CellCertificate":
        fields = {name: getattr(self, name) for name in ("number", "issued", "issued_by", "expanded_uncertainty")}
        missing = [name for name, value in fields.items() if value is None]
        if self.dcc is None and missing:
            raise ValueError(
                f"write {missing[0]} of the certificate too (uncertainties relative, 0.0024 for 0.24 %), or its dcc"
            )
        if self.dcc is not None and len(missing) < len(fields):
            raise ValueError(
                "dcc names a file that says the rest; leave number, issued, issued_by and expanded_uncertainty out"
            )
        return self

    def read(self, folder: Path) -> CalibratedCell:
        """Return what the certificate says of the cell.

        Args:
            folder: Folder of laboratory.toml.

        Raises:
            DatasetError: The file cannot be read as a certificate of a load cell.
        """
        if self.dcc is not None:
            return read_load_cell(folder / self.dcc)
        assert self.issued is not None and self.expanded_uncertainty is not None  # see _complete
        relative = self.expanded_uncertainty / self.coverage_factor
        return CalibratedCell(
            self.number or "", self.issued.isoformat(), self.issued_by or "", relative, self.coverage_factor
        )


class Production(Frozen):
    """How a quantity is distributed over a production: its mean and standard deviation."""

    mean: Finite
    sd: Positive


class StatedLimit(Frozen):
    """Limits of a quantity, and the rule by which conformity is decided."""

    quantity: Name
    at_least: Finite | None = None
    at_most: Finite | None = None
    guard_band: NonNegative = 1.0
    source: Text = ""
    production: Production | None = None

    @model_validator(mode="after")
    def _limited(self) -> "StatedLimit":
        if self.at_least is None and self.at_most is None:
            raise ValueError("write at_most, at_least or both")
        if self.tolerance.lower >= self.tolerance.upper:
            raise ValueError(f"at_least = {self.at_least} must be below at_most = {self.at_most}")
        return self

    @property
    def tolerance(self) -> ToleranceInterval:
        """The limits as an interval."""
        lower = -math.inf if self.at_least is None else self.at_least
        return ToleranceInterval(lower, math.inf if self.at_most is None else self.at_most)


class Signature(Frozen):
    """Who signs: a role, and the name of the person if it is known."""

    role: Name
    name: Name | None = None


class LaboratoryFile(Frozen):
    """Everything that `laboratory.toml` says."""

    schema_: Annotated[int, Field(alias="schema", ge=1, le=SCHEMA)] = SCHEMA
    number: Name
    issued: date
    laboratory: Party
    customer: Party
    item: CalibratedItem
    measured: MeasuringConditions
    cell: tuple[CellCertificate, ...] = ()
    limit: tuple[StatedLimit, ...] = ()
    signature: Annotated[tuple[Signature, ...], Field(min_length=1)] = (
        Signature(role="Person in charge"),
        Signature(role="Head of the laboratory"),
    )

    model_config = ConfigDict(frozen=True, extra="forbid", populate_by_name=True)


def read_laboratory(path: Path) -> LaboratoryFile:
    """Read `laboratory.toml`.

    Args:
        path: The file.

    Raises:
        DescriptionError: It is missing or no TOML, or keys are unknown, missing or impossible; says all of them.
    """
    _, raw = read_toml_file(path, _REMEDY)
    try:
        laboratory = LaboratoryFile.model_validate(raw)
    except ValidationError as error:
        raise explain_validation_error(
            error, raw, LaboratoryFile, path.name, "docs/certificates.md shows one"
        ) from None
    names = [limit.quantity for limit in laboratory.limit]
    if twice := next((name for name in names if names.count(name) > 1), None):
        raise DescriptionError(f"{path.name}: {twice} has two [[limit]] entries; write at_least and at_most into one.")
    return laboratory
