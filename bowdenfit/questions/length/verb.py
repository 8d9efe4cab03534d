"""The verb `length`: which length is best."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any

from bowdenfit import results
from bowdenfit.arguments import FIT, RESULTS, read_first
from bowdenfit.verb import NOT_TRUSTED, Reply, Verb

if TYPE_CHECKING:
    from bowdenfit.results.optimal_length import OptimalLength
    from bowdenfit.results.record import Record


@read_first
def length(fit: Annotated["Record", RESULTS, FIT]) -> "OptimalLength":
    """The design answer: which length is best, how sure that is, and what the lengths that can be bought cost.

    Args:
        fit: The fit.

    Raises:
        UsageError: The description has no route to vary, or there is no posterior.
    """
    from bowdenfit.questions.error_budget import find_optimal_length  # here, as a kept answer needs no JAX

    return find_optimal_length(fit)


def _reply(answer: "OptimalLength", _: object) -> Reply:
    """Return what the command line prints."""
    return Reply(f"{answer}\n", lambda: answer, csv=answer.to_csv, exit_code=0 if answer.is_certain else NOT_TRUSTED)


def _reply_from_stored(answers: Mapping[str, Any], options: Mapping[str, Any]) -> Reply | None:
    """Return the reply of a stored answer; None where it is not stored."""
    if "length" not in answers:
        return None
    return _reply(results.deserialize(results.OptimalLength, answers["length"]), options)


VERB = Verb(
    length,
    _reply,
    """Say which length is best.

    This is the design answer: which length is best, how sure that is, and what the
    lengths that can be bought cost.
    """,
    csv="Print the lengths that can be bought as CSV; where none are named, the best length and the efficiency there.",
    warns=True,
    kept=_reply_from_stored,
)
