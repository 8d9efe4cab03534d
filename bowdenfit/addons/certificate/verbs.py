"""The verbs `certificate` and `cell`: certify a fit; read the certificate of a load cell."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from bowdenfit.addons import certificate as room
from bowdenfit.arguments import PATH, RESULTS, Output, Reader, read_first
from bowdenfit.errors import UsageError
from bowdenfit.verb import Reply, Verb
from bowdenfit.words import shown

if TYPE_CHECKING:
    from bowdenfit.addons.certificate.answer import Certificate
    from bowdenfit.addons.certificate.calibrated_cell import CalibratedCell
    from bowdenfit.results.record import Record

LABORATORY = Parameter(
    "LABORATORY", help="Such as laboratory.toml, which says who measured what with which load cells."
)
CELL = Parameter("CELL", help="Such as cell.xml, a PTB Digital Calibration Certificate.")
NOTE = "Written to {} and {}."


def _read_probability(value: Any, name: str) -> float:
    try:
        probability = float(value)
    except (TypeError, ValueError):
        probability = 0.0
    if not 0.5 <= probability <= 0.999:
        raise UsageError(f"{name} = {shown(value)} must be a probability from 0.5 to 0.999, such as 0.95.")
    return probability


@read_first
def certificate(
    fit: Annotated["Record | str | Path", RESULTS, PATH],
    laboratory: Annotated[str | Path, LABORATORY, PATH],
    output: Annotated[Output, Parameter(show_default="RESULTS")] = None,
    *,
    probability: Annotated[float, Parameter(metavar="NUMBER"), Reader(_read_probability)] = 0.95,
) -> "Certificate":
    """Certify a fit: results by the GUM, conformity by JCGM 106, as a page to sign and as a Digital Calibration Certificate.

    Args:
        fit: The fit, or its results folder.
        laboratory: A laboratory.toml that says who measured what, with which load cells, for whom, and within which limits.
        output: Folder for certificate.html and certificate.xml.
        probability: Coverage probability of the expanded uncertainties.

    Raises:
        BowdenfitError: The fit is not to be trusted, or something that a certificate needs is missing or wrong.
    """
    return room.write_certificate(fit, laboratory, output, probability)[0]


def _reply(answer: "Certificate", options: Mapping[str, Any]) -> Reply:
    folder = Path(options["output"] if options["output"] is not None else options["fit"])
    note = NOTE.format(folder / "certificate.html", folder / "certificate.xml")
    return Reply(f"{answer}\n", lambda: answer, (note,), csv=answer.to_csv)


CERTIFICATE = Verb(
    certificate,
    _reply,
    """Certify a fit, with uncertainties by the GUM and conformity by JCGM 106.

    Writes certificate.html, a page to print on A4 and sign, and certificate.xml,
    the same as a PTB Digital Calibration Certificate (DCC): each quantity with its
    expanded uncertainty, coverage factor and effective degrees of freedom, its
    budget of type A and B, conformity with stated limits and the risks of both
    sides, what was measured with which load cells, and where the numbers come from.

    LABORATORY is a laboratory.toml; docs/certificates.md shows one. A fit that is
    not to be trusted gets no certificate: nothing is written, exit code 3.
    """,
    csv="Print the results as CSV, one a row.",
)


@read_first
def cell(
    certificate_file: Annotated[str | Path, CELL, PATH],
    *,
    end: Annotated[Literal["input", "output"], Parameter(help="End of the cable at which the cell is.")] = "input",
) -> "CalibratedCell":
    """What the digital certificate of a load cell says about its gain.

    Args:
        certificate_file: A PTB Digital Calibration Certificate, XML.
        end: End of the cable at which the cell is.

    Raises:
        DatasetError: It is no such certificate, or does not state the uncertainty of its forces.
    """
    return room.read_load_cell(certificate_file, end)


CELL_VERB = Verb(
    cell,
    lambda answer, _: Reply(f"{answer.toml}\n", lambda: answer, tuple(answer.sentences())),
    """Say what the certificate of a load cell adds to cable.toml.

    CELL is a PTB Digital Calibration Certificate (XML). Prints the lines to write
    into cable.toml: the gain error of the cell, one standard deviation, and its
    ratio where the certificate shows that its forces are too small or too large.
    """,
)
