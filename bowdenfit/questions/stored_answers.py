"""Which answers of a fit are kept in its folder: what verbs are asked most, where that needs no further physics."""

from typing import Any

import numpy as np

from bowdenfit.questions.identify.judgment import assess_identifiability
from bowdenfit.questions.predict.lengths import predict_at_lengths
from bowdenfit.questions.summary.verdict import assess_fit
from bowdenfit.results.record import Record
from bowdenfit.results.serialization import serialize


def collect_answers(fit: Record) -> dict[str, Any]:
    """Plain data by question; what a fit cannot answer is not among them.

    Args:
        fit: The fit.
    """
    answers: dict[str, Any] = {"troubles": list(assess_fit(fit).troubles)}
    if fit.sampled is not None:
        answers["identify"] = serialize(vars(assess_identifiability(fit)))
        if (route := fit.dataset.description.route) is not None:
            answers["length"] = serialize(fit.optimal_length())
            if route.choices:
                rows = predict_at_lengths(fit, np.asarray(route.choices), None, "pull")
                answers["predict"] = [[length, serialize(row)] for length, row in zip(route.choices, rows, strict=True)]
    return answers
