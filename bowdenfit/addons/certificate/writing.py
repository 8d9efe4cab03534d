"""Writing a certificate: the page and the XML, both or none."""

from pathlib import Path

from bowdenfit.addons.certificate.answer import Certificate, certify
from bowdenfit.addons.certificate.dcc import certificate_xml
from bowdenfit.addons.certificate.page import certificate_page
from bowdenfit.errors import UsageError
from bowdenfit.pages.page import render_page
from bowdenfit.results.folder import file_to_write
from bowdenfit.results.record import Record
from bowdenfit.results.store import load

NAME = "certificate"


def write_certificate(
    fit: Record | str | Path, laboratory_file: str | Path, output: str | Path | None, probability: float
) -> tuple[Certificate, tuple[Path, Path]]:
    """Write the certificate of a fit as HTML and as XML.

    Args:
        fit: The fit, or its results folder.
        laboratory_file: What the laboratory states.
        output: Folder for both files; the results folder if None.
        probability: Coverage probability.

    Returns:
        The certificate, and the files written.

    Raises:
        BowdenfitError: See `certify`; or a fit is given without a folder, or the folder cannot be written.
    """
    if isinstance(fit, str | Path):
        output, fit = Path(fit) if output is None else output, load(Path(fit))
    if output is None:
        raise UsageError("a fit on its own has no folder; name one for the certificate.")
    certificate = certify(fit, laboratory_file, probability)
    contents = render_page(certificate_page(fit, certificate), {}).encode(), certificate_xml(fit, certificate)
    page_file, xml_file = (Path(output) / f"{NAME}.{ending}" for ending in ("html", "xml"))
    with file_to_write(page_file) as page_draft, file_to_write(xml_file) as xml_draft:
        page_draft.write_bytes(contents[0])
        xml_draft.write_bytes(contents[1])
    return certificate, (page_file, xml_file)
