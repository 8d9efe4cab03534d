"""Readings that were copied from others, in sentences with a remedy."""

from bowdenfit.dataset import Dataset
from bowdenfit.kinds import iterate_tables


def describe_copied_readings(dataset: Dataset) -> tuple[str, ...]:
    """Describe readings that were pasted twice or saved as another run; none where equal readings may be chance."""
    copies = [sentence for kind, table in iterate_tables(dataset.measurements) for sentence in kind.copied_readings(table)]
    return tuple(
        f"{sentence[0].upper()}{sentence[1:]}. Measurements do not repeat themselves so exactly; the usual cause is a table "
        "that was pasted or exported twice, or a run that was copied and not measured. Copies count as measurements, so that "
        "intervals are too narrow: leave them out, or put in what was measured."
        for sentence in copies
    )
