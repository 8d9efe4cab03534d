"""What was exported: the file, and what it holds."""

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from bowdenfit.display import Display, Rows


@dataclass(frozen=True, repr=False)
class ExportedFile(Display):
    """A file written for another program.

    Args:
        file: The file.
        format: Its format.
        says: What it says at its top.
        trusted: Whether the fit may be trusted.
        remarks: What the format does not hold, or what else was to be known.
    """

    file: Path
    format: str
    says: tuple[str, ...]
    trusted: bool
    remarks: tuple[str, ...] = ()

    JSON: ClassVar = (("file", "_path"), "format", "says", "trusted", "remarks")

    def _path(self) -> str:
        return str(self.file)

    def __str__(self) -> str:
        return "\n".join(self.sentences())

    def sentences(self) -> list[str]:
        """The file, and what is to be known of it."""
        return [f"Wrote {self.file}.", *self.remarks]

    def _table(self) -> Rows:
        return [{"file": str(self.file), "format": self.format}], {}
