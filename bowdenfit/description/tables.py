"""What stands under [tables]: the kinds of measurement add the settings of their own."""

from typing import Any

from pydantic import Field, model_validator

from bowdenfit.description.values import Frozen
from bowdenfit.units import ColumnSource


class TableSettings(Frozen):
    """What all that stands under [tables] has in common."""

    @property
    def fits_offsets(self) -> bool:
        """Whether it asks for the load cells' offsets to be parameters."""
        return False

    @property
    def measures_preload(self) -> bool:
        """Whether its readings tell how preload depends on the wrap angle."""
        return False


class Table(TableSettings):
    """One table: its file or files, and columns that do not carry the usual names."""

    file: str | None = None
    files: str | tuple[str, ...] | None = None
    columns: dict[str, ColumnSource] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _one_source(self) -> "Table":
        if self.file == "" or self.files in ("", ()):
            raise ValueError('the name of the file is empty; write file = "name.csv" or files = "folder/*.csv"')
        if (self.file is None) == (self.files is None):
            raise ValueError('write either file = "name.csv" or files = "folder/*.csv"')
        return self


class Tables(Frozen):
    """The tables of a data set by their kinds, which `bowdenfit.kinds.descriptions` adds as fields."""

    @model_validator(mode="after")
    def _some(self) -> "Tables":
        if not self.model_fields_set:
            raise ValueError('name at least one table, such as efficiencies = { file = "efficiencies.csv" }')
        return self

    @property
    def stated(self) -> dict[str, Any]:
        """What is said of each table that there is, by the name of its kind."""
        return {name: settings for name in type(self).model_fields if (settings := getattr(self, name)) is not None}
