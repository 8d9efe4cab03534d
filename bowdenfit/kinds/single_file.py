"""Which kind of table a file is that no description names."""

from contextlib import nullcontext
from itertools import islice
from pathlib import Path

from bowdenfit.files.csv_table import read_csv
from bowdenfit.files.matching import Quantity, meanings

_LONG = 200  # rows beyond which a table of forces is a recording


def kind_of(path: Path, has_channels: bool, has_columns: bool = False) -> str:
    """Which kind of table a file without a description is.

    A CSV file is a recording if it is long, or if its rows have a time and neither a run nor a stroke.
    """
    if has_channels or (path.suffix.lower() not in {".csv", ".txt", ".tsv"} and not has_columns):
        return "recordings"
    with path.open("rb") if path.is_file() else nullcontext() as file:
        lines = sum(1 for _ in islice(file, _LONG + 1)) if file is not None else 0
    if lines > _LONG and not has_columns:
        return "recordings"
    header = read_csv(path).header
    if any("efficiency" in heading.lower() for heading in header):
        return "efficiencies"
    wanted = (Quantity("time", "time"), Quantity("run", "text"), Quantity("stroke", "text"))
    found = {quantity.name for heading in header for quantity, _ in meanings(heading, wanted)}
    return "recordings" if found == {"time"} else "forces"
