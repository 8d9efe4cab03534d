"""Predictions, a row a place: a list of plain rows that shows itself."""

from typing import Any

from bowdenfit.display import Display, Rows
from bowdenfit.questions.predict.words import predictions_text, units_of


class Predictions(Display, list[dict[str, Any]]):
    """What `predict` answers; units of forces, lengths and angles stand in the names of the columns."""

    def __str__(self) -> str:
        return predictions_text(self).strip()

    def _table(self) -> Rows:
        return self, units_of(self[0] if self else {})
