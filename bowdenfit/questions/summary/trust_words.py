"""Whether a fit may be trusted and why not, and what to do next, in sentences without terms of statistics."""

from bowdenfit.kinds import reading_called
from bowdenfit.questions.check.answer import checks_of
from bowdenfit.questions.check.sensitivity_words import describe_assumed_widths
from bowdenfit.questions.check.table_checks import CheckedReading
from bowdenfit.questions.check.words import describe_misfits
from bowdenfit.questions.identify.confounding import confounded_pairs
from bowdenfit.questions.identify.judgment import identifiability
from bowdenfit.questions.identify.verb import NOT_IDENTIFIABLE
from bowdenfit.questions.next.candidates import can_be_ranked
from bowdenfit.questions.summary.answer import readings_off
from bowdenfit.questions.summary.verdict import (
    COARSE,
    CONTRADICTORY,
    COPIED,
    IMPOSSIBLE,
    NOT_CONVERGED,
    NOT_DESCRIBED,
    Verdict,
    verdict,
)
from bowdenfit.results.record import Record
from bowdenfit.words import few, filled, listed

_WRONG = {
    NOT_CONVERGED: "the computation has not settled",
    CONTRADICTORY: "the measurements contradict each other",
    IMPOSSIBLE: "some of the readings cannot be",
    COPIED: "some of the readings are copies of others",
    COARSE: "the readings are too coarse for such intervals",
    NOT_DESCRIBED: "the model does not describe these readings",
    NOT_IDENTIFIABLE: "the measurements do not tell every coefficient",
}
_SETTLED = "You can trust this: the computation has settled, and the readings agree with the model and with each other."
_IN_DOUBT = (
    "The computation has settled, and nothing speaks clearly against the model, but {}, by more than chance does in one fit of "
    "a hundred. You can trust this once you know why."
)
_ALONE = (
    "Nothing speaks against these numbers, but they are least squares alone{}. A mistake in a single reading, such as "
    "two of them exchanged, may go unseen; fit again without --no-mcmc for the full answer."
)
_MOVING = (
    "The numbers still move, and may be far off. Let it go on with the same command and --resume; if that does not end it, "
    "state what you know of the coefficients in cable.toml."
)
_NO_MINIMUM = (
    "Least squares have found no minimum that can be trusted, and the numbers may be far off. Fit again without --no-mcmc: "
    "sampling needs none."
)


def verdict_text(found: Verdict) -> str:
    """Whether a fit may be trusted, and if not, why."""
    said = (
        [warning(found), *reasons(found)]
        if found.troubles
        else [_settled(found) if found.sampled else _ALONE.format("")]
    )
    return "\n".join(filled(sentence) for sentence in said)


def warning(found: Verdict) -> str:
    """The first line of a fit that is not to be trusted; empty of one that is."""
    kinds = [words for kind, words in _WRONG.items() if kind in found.troubles]
    return f"DO NOT USE THESE NUMBERS: {listed(kinds)}." if kinds else ""


def reasons(found: Verdict) -> list[str]:
    """Why not, without what only says how the computation went."""
    said = [sentence for kind in _WRONG if kind != NOT_CONVERGED for sentence in found.troubles.get(kind, ())]
    if NOT_CONVERGED in found.troubles:
        said.append(_MOVING if found.sampled else _NO_MINIMUM)
    return said


def trust(fit: Record) -> list[str]:
    """What speaks for a fit that may be trusted, and what to keep in mind."""
    if fit.sampled is None:
        best = ", without a best length" if fit.dataset.description.route is not None else ""
        return [_ALONE.format(best)]
    return [_settled(verdict(fit))] + [
        sentence for sentence in (_resting(fit), _alike(fit), _prior_against(fit)) if sentence
    ]


def _settled(found: Verdict) -> str:
    """Of a fit that may be trusted, and what speaks a little against it."""
    return _IN_DOUBT.format(listed(found.doubts)) if found.doubts else _SETTLED


def next_step(fit: Record) -> str:
    """What to do next with a fit that may be trusted; empty where there is nothing."""
    found, off = checks_of(fit), readings_off(fit)
    if found is None:
        return ""
    if off:
        return f"Next: look at how {_named(off[0])} was measured and written down: it is far off (see below)."
    if describe_misfits(found):
        return "Next: look at what is stated of the noise of these readings; checks.png shows where each of them lies."
    leant_on = few(map(_named, found.influential), most=2)  # how far on each differs from one seed to the next
    again = f"; in doubt, measure again what the fit leans on: {leant_on}" if leant_on else ""
    if fit.dataset.description.route is not None and fit.optimal_length().is_certain:
        return f"Next: nothing needs to be measured{again}. bowdenfit next says what would narrow it."
    if not can_be_ranked(fit):
        return f"Next: any measurement of another kind or at other bends would tell more{again}."
    return f"Next: bowdenfit next says which measurement would tell most{again}."


def _named(reading: CheckedReading) -> str:
    return reading_called(reading.table, reading.label)


def assumed(fit: Record) -> str:
    """That few readings leave it to a prior how wide intervals are; empty where they do not."""
    found = checks_of(fit)
    return describe_assumed_widths(found) if found else ""


def _resting(fit: Record) -> str:
    """Coefficients of friction that no measurement tells, because they were stated."""
    friction = identifiability(fit).groups.get("friction")
    names = friction.resting if friction is not None else []
    return f"Hardly measured, mostly as assumed beforehand: {listed(names)}." if names else ""


def _alike(fit: Record) -> str:
    """The two parameters that are told apart least."""
    pairs = confounded_pairs(fit)
    if not pairs:
        return ""
    pair = pairs[0]
    return f"{pair.first} and {pair.second} are hardly told apart; {pair.combination} is known much better than each."


def _prior_against(fit: Record) -> str:
    """Parameters about which readings and prior contradict each other."""
    found = checks_of(fit)
    pulled = [s.parameter for s in found.conflicts] if found else []
    names = dict.fromkeys(pulled + [f.parameter for f in found.prior_conflicts] if found else [])
    return f"The readings contradict what was assumed of {listed(list(names))} beforehand; check its unit." if names else ""
