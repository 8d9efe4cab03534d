"""Whether a fit may be trusted, and if not, why; whatever the summary says is wrong is wrong here too."""

from dataclasses import dataclass

from bowdenfit.display import Display, Rows
from bowdenfit.kinds import reading_called
from bowdenfit.questions.check.answer import checks_of
from bowdenfit.questions.check.copied import describe_copied_readings
from bowdenfit.questions.check.impossible import describe_implausible_friction, describe_impossible_efficiencies
from bowdenfit.questions.check.lack_of_fit import describe_lack_of_fit
from bowdenfit.questions.check.too_coarse import describe_coarse_readings
from bowdenfit.questions.check.words import describe_misfits
from bowdenfit.questions.identify.contradiction import contradiction
from bowdenfit.questions.identify.judgment import say_what_is_not_determined
from bowdenfit.questions.identify.verb import NOT_IDENTIFIABLE
from bowdenfit.results.record import Record, cached_per_fit
from bowdenfit.words import few

NOT_CONVERGED, CONTRADICTORY = "not converged", "contradictory"
IMPOSSIBLE, NOT_DESCRIBED = "made of impossible readings", "not a description of its readings"
COPIED, COARSE = "made of copied readings", "finer than its readings"


@dataclass(frozen=True, repr=False)
class Verdict(Display):
    """Of one fit.

    Args:
        troubles: What is wrong, by kind: `NOT_CONVERGED`, `NOT_IDENTIFIABLE`, `CONTRADICTORY`, `IMPOSSIBLE`,
            `NOT_DESCRIBED`, `COPIED`, `COARSE`; each with sentences.
        sampled: Whether there are draws.
        doubts: What chance does in one fit of a hundred or less, and is not enough to distrust it; clauses without a stop.
    """

    troubles: dict[str, tuple[str, ...]]
    sampled: bool = True
    doubts: tuple[str, ...] = ()

    @property
    def trusted(self) -> bool:
        """Whether the answers may be used."""
        return not self.troubles

    @property
    def reasons(self) -> tuple[str, ...]:
        """Every sentence."""
        return tuple(sentence for sentences in self.troubles.values() for sentence in sentences)

    def _table(self) -> Rows:
        return [{"trouble": kind, "reason": reason} for kind, said in self.troubles.items() for reason in said], {}


@cached_per_fit
def verdict(fit: Record) -> Verdict:
    """The verdict on a fit."""
    troubles = {
        NOT_CONVERGED: () if fit.converged else fit.reasons or ("the fit did not converge",),
        NOT_IDENTIFIABLE: _sentences(say_what_is_not_determined(fit)),
        CONTRADICTORY: _sentences(contradiction(fit)),
        IMPOSSIBLE: _sentences(describe_impossible_efficiencies(fit)) + _sentences(describe_implausible_friction(fit)),
        COPIED: describe_copied_readings(fit.dataset),
        COARSE: describe_coarse_readings(fit),
        NOT_DESCRIBED: describe_lack_of_fit(fit),
    }
    said = {kind: sentences for kind, sentences in troubles.items() if sentences}
    return Verdict(said, fit.sampled is not None, _doubts(fit))


def _doubts(fit: Record) -> tuple[str, ...]:
    """Readings that lie far off, and tables that scatter otherwise than the fit says."""
    found = checks_of(fit)
    if found is None:
        return ()
    off = [reading_called(each.table, each.label) for each in found.outliers]
    far = [f"{few(off)} {'lies' if len(off) == 1 else 'lie'} far from what the others say"] if off else []
    return (*far, *describe_misfits(found))


def _sentences(sentence: str) -> tuple[str, ...]:
    return (sentence,) if sentence else ()
