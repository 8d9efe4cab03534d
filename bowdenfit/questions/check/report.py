"""A data set that was checked, with what was understood of it."""

from dataclasses import dataclass

from bowdenfit.dataset import Dataset
from bowdenfit.questions.check.data_set_words import describe_data_set, warnings_of


@dataclass(frozen=True, repr=False)
class Report(Dataset):
    """A data set that shows itself as `bowdenfit check` does; it can be fitted as it is."""

    @property
    def warnings(self) -> list[str]:
        """What the measurements will not be able to tell, as far as counting shows."""
        return warnings_of(self)

    def __str__(self) -> str:
        return describe_data_set(self).strip()
