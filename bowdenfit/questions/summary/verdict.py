"""Whether a fit may be trusted, and if not, why; whatever the summary says is wrong is wrong here too."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from bowdenfit.arguments import Purpose
from bowdenfit.cable.sensors import RUN_SCATTER
from bowdenfit.display import Display, Rows, blocks_of
from bowdenfit.inference.disagreement import NOTICEABLE_SDS, Disagreement
from bowdenfit.kinds import describe_reading, find_readings
from bowdenfit.questions.check.answer import check_readings
from bowdenfit.questions.check.data_set_words import (
    describe_bench_faults,
    describe_copied_readings,
    describe_cut_off_readings,
    describe_wrong_angles,
)
from bowdenfit.questions.check.implausible_readings import (
    describe_coarse_readings,
    describe_implausible_friction,
    describe_impossible_efficiencies,
)
from bowdenfit.questions.check.lack_of_fit import describe_lack_of_fit
from bowdenfit.questions.check.table_checks import CheckedReading
from bowdenfit.questions.check.words import describe_assumed_widths, describe_misfits
from bowdenfit.questions.error_budget import errors_beyond_limits, find_optimal_length
from bowdenfit.questions.identify.judgment import (
    assess_identifiability,
    confounded_pairs,
    describe_coefficients_to_leave,
    describe_unidentified,
)
from bowdenfit.questions.identify.verb import NOT_IDENTIFIABLE
from bowdenfit.questions.next.candidates import has_candidates, rests_on_one_mounting
from bowdenfit.questions.recorded.presliding import describe_wrong_delay
from bowdenfit.questions.recorded.recording_caveats import describe_distant_delay
from bowdenfit.questions.summary.curve_departures import describe_refuted_families
from bowdenfit.questions.summary.usable_answers import UsableAnswers, find_usable_answers
from bowdenfit.results.record import Record, cached_per_fit
from bowdenfit.results.serialization import values_by_key
from bowdenfit.words import decimals, few, listed

NOT_CONVERGED, CONTRADICTORY = "not converged", "contradictory"
IMPOSSIBLE, NOT_DESCRIBED = "made of impossible readings", "not a description of its readings"
COPIED, COARSE = "made of copied readings", "finer than its readings"
CUT_OFF = "made of cut-off readings"


_PROBLEMS = {
    NOT_CONVERGED: "the fit has not converged",
    CONTRADICTORY: "the measurements contradict each other",
    IMPOSSIBLE: "some of the readings are physically impossible",
    COPIED: "some of the readings are copies of others",
    CUT_OFF: "some of the readings are cut off where a range ends",
    COARSE: "the readings are too coarse for such intervals",
    NOT_DESCRIBED: "the model does not describe these readings",
    NOT_IDENTIFIABLE: "the measurements do not determine every coefficient",
}
_NO_LENGTH = "the measurements determine neither every coefficient nor which lengths are good enough"
_NO_EFFICIENCY = "the measurements determine neither every coefficient nor the efficiency at the best length"
_TRUSTED = "You can trust this: the fit has converged, and the readings agree with the model and with each other."
_LENGTH_TRUSTED = (
    "You can trust the best length and the efficiency there: the fit has converged, the readings agree with the model and with "
    "each other, and other coefficients that agree with them give the same."
)
_NUMBERS_TRUSTED = (
    "You can trust these numbers: the fit has converged, and the readings agree with the model and with each other. Which "
    "length is good enough they do not show yet."
)
_TRUSTED_ALONE = "You can trust this: the fit has converged, and the reading agrees with the model."
_IN_DOUBT = (
    "The fit has converged, and nothing speaks clearly against the model, but {}, by more than happens by chance in one fit "
    "in a hundred. You can trust this once you know why."
)
_LEAST_SQUARES_ONLY = (
    "Nothing speaks against these numbers, but they come from least squares alone{}. A mistake in a single reading, such as "
    "two of them exchanged, may go unseen; fit again without --no-mcmc for the full answer."
)
_NOT_YET_CONVERGED = (
    "The numbers still change as sampling goes on, and may be far off. Continue with the same command and --resume; if that "
    "does not help, state what you know about the coefficients in cable.toml."
)
_WEIGHTS_UNEVEN = (
    "The weighted draws do not suffice, and the numbers may be far off. Fit again with --sampler emcee, whose walkers need no "
    "weights."
)
_NO_MINIMUM = (
    "Least squares found no minimum that can be trusted, and the numbers may be far off. Fit again without --no-mcmc: "
    "sampling needs no minimum."
)
BETWEEN_MOUNTINGS = "scatter between mountings"  # what tau is, in the words of a page
_COMPARABLE = 0.8  # share of the largest conflict beyond which either table may be wrong; a judgement


@dataclass(frozen=True, repr=False)
class Verdict(Display):
    """Verdict on a fit.

    Args:
        troubles: What is wrong, by kind: `NOT_CONVERGED`, `NOT_IDENTIFIABLE`, `CONTRADICTORY`, `IMPOSSIBLE`,
            `NOT_DESCRIBED`, `COPIED`, `CUT_OFF`, `COARSE`; each with sentences.
        sampled: Whether there are draws.
        doubts: What chance does in one fit in a hundred or less, and is not enough to distrust it; clauses without a stop.
        usable: Which answers rest on the readings, and which on priors of coefficients.
        coefficients_to_leave: Sentence on the coefficients that must not be used by themselves, where the design answer holds
            all the same; empty where there are none.
        weighted: Whether the draws are those of importance sampling.
    """

    troubles: dict[str, tuple[str, ...]]
    sampled: bool = True
    doubts: tuple[str, ...] = ()
    usable: UsableAnswers = field(default_factory=lambda: UsableAnswers(None, None, ()))
    coefficients_to_leave: str = ""
    weighted: bool = False

    @property
    def trusted(self) -> bool:
        """Whether the answers may be used."""
        return not self.troubles

    @property
    def reasons(self) -> tuple[str, ...]:
        """Every sentence."""
        return tuple(sentence for sentences in self.troubles.values() for sentence in sentences)

    @property
    def answers(self) -> dict[str, Any]:
        """Whether each answer may be used, by name; of coefficients by theirs those that may not."""
        design = {
            name: bool(usable) and self.trusted
            for name, usable in (("best_length", self.usable.length), ("efficiency", self.usable.efficiency))
            if usable is not None
        }
        return design | {"coefficients_to_leave": list(self.usable.undetermined)}

    def may_be_used_for(self, purpose: Purpose) -> bool:
        """Whether the answer for a purpose may be used: a length that is good enough, or else the numbers."""
        if purpose == "coefficients":
            return self.for_coefficients().trusted
        return self.trusted and self.usable.length is not False and self.usable.efficiency is not False

    def for_coefficients(self) -> "Verdict":
        """Return the verdict for somebody who wants the coefficients: all of them must be determined."""
        if not self.coefficients_to_leave:
            return self
        return replace(
            self, troubles={**self.troubles, NOT_IDENTIFIABLE: (self.coefficients_to_leave,)}, coefficients_to_leave=""
        )

    def sentences(self) -> list[str]:
        """Return whether the fit may be trusted, and if not, why."""
        if self.troubles:
            return [distrust_warning(self), *reasons_against(self)]
        return [_trusted_sentence(self) if self.sampled else _LEAST_SQUARES_ONLY.format("")]

    def _table(self) -> Rows:
        return [{"trouble": kind, "reason": reason} for kind, reasons in self.troubles.items() for reason in reasons], {}


blocks_of.register(Verdict)(Verdict.sentences)


@cached_per_fit
def assess_fit(fit: Record) -> Verdict:
    """Return the verdict on a fit."""
    copies, usable = describe_copied_readings(fit.dataset), find_usable_answers(fit)
    troubles = {
        NOT_CONVERGED: () if fit.converged else fit.reasons or ("the fit did not converge",),
        NOT_IDENTIFIABLE: () if usable.holds else _sentences(describe_unidentified(fit)),
        CONTRADICTORY: describe_wrong_angles(fit.dataset) + _sentences(describe_contradiction(fit)),
        IMPOSSIBLE: _sentences(describe_impossible_efficiencies(fit)) + _sentences(describe_implausible_friction(fit)),
        COPIED: copies,
        CUT_OFF: describe_cut_off_readings(fit.dataset),
        COARSE: describe_coarse_readings(fit),
        # Copies make the least departure certain.
        NOT_DESCRIBED: () if copies else _describe_misfits(fit),
    }
    by_kind = {kind: sentences for kind, sentences in troubles.items() if sentences}
    to_leave = describe_coefficients_to_leave(fit) if usable.holds else ""
    weighted = fit.sampled is not None and fit.sampled.sampler == "importance"
    return Verdict(by_kind, fit.sampled is not None, _describe_doubts(fit), usable, to_leave, weighted)


def _describe_misfits(fit: Record) -> tuple[str, ...]:
    """Describe what the model leaves out: faults of the bench, a wrong delay, and lack of fit."""
    delays = _sentences(describe_wrong_delay(fit)) + _sentences(describe_distant_delay(fit))
    lack = describe_lack_of_fit(fit)
    if lack and (beyond := errors_beyond_limits(fit)):
        lack += (f"The readings reveal that {listed(beyond)}; correct the readings, or state a limit that the bench keeps.",)
    return describe_bench_faults(fit.dataset) + delays + lack


def assess_for(fit: Record, purpose: Purpose) -> Verdict:
    """Return the verdict on a fit for a purpose."""
    return assess_fit(fit) if purpose == "design" else assess_fit(fit).for_coefficients()


def _describe_doubts(fit: Record) -> tuple[str, ...]:
    """Describe readings that lie far off, and tables that scatter otherwise than predicted."""
    checks, of_bench = check_readings(fit), errors_beyond_limits(fit)
    if checks is None:
        return tuple(of_bench)
    outliers = [describe_reading(reading.table, reading.label) for reading in checks.outliers]
    lie = "lies" if len(outliers) == 1 else "lie"
    sentences = [f"{few(outliers)} {lie} far from what the other readings predict"] if outliers else []
    return (*sentences, *describe_misfits(checks), *of_bench)


def _sentences(sentence: str) -> tuple[str, ...]:
    """Return a sentence as a tuple; an empty one where there is none."""
    return (sentence,) if sentence else ()


def collect_checked_readings(fit: Record) -> tuple[CheckedReading, ...]:
    """Return every reading beside its prediction from all the others; none without draws."""
    checks = check_readings(fit)
    return checks.readings if checks else ()


def find_outliers(fit: Record) -> Sequence[CheckedReading]:
    """Return the outliers among the readings, the farthest first."""
    checks = check_readings(fit)
    return checks.outliers if checks else ()


def distrust_warning(fit_verdict: Verdict) -> str:
    """Return the first line of a fit that is not to be trusted; empty of one that is."""
    kinds = [words for kind, words in _PROBLEMS.items() if kind in fit_verdict.troubles]
    if NOT_IDENTIFIABLE in fit_verdict.troubles and fit_verdict.usable.length is not None and not fit_verdict.usable.holds:
        kinds[kinds.index(_PROBLEMS[NOT_IDENTIFIABLE])] = _NO_LENGTH if not fit_verdict.usable.length else _NO_EFFICIENCY
    return f"DO NOT USE THESE NUMBERS: {listed(kinds)}." if kinds else ""


def reasons_against(fit_verdict: Verdict) -> list[str]:
    """Return the reasons not to trust a fit, without what only says how the computation went."""
    sentences = [sentence for kind in _PROBLEMS if kind != NOT_CONVERGED for sentence in fit_verdict.troubles.get(kind, ())]
    if NOT_CONVERGED in fit_verdict.troubles:
        of_draws = _WEIGHTS_UNEVEN if fit_verdict.weighted else _NOT_YET_CONVERGED
        sentences.append(of_draws if fit_verdict.sampled else _NO_MINIMUM)
    return sentences


def reasons_to_trust(fit: Record) -> list[str]:
    """Return what speaks for a fit that may be trusted, and what to keep in mind."""
    if fit.sampled is None:
        best = ", without a best length" if fit.dataset.description.route is not None else ""
        return [_LEAST_SQUARES_ONLY.format(best)]
    checks, fit_verdict = check_readings(fit), assess_fit(fit)
    is_alone = checks is not None and len(checks.readings) == 1 and not fit_verdict.doubts
    trusted = _TRUSTED_ALONE if is_alone else _trusted_sentence(fit_verdict)
    if fit_verdict.coefficients_to_leave:
        return [trusted, fit_verdict.coefficients_to_leave, *describe_refuted_families(fit)]
    return [trusted, *describe_refuted_families(fit)] + [
        sentence
        for sentence in (_prior_driven_sentence(fit), _correlation_sentence(fit), _prior_conflict_sentence(fit))
        if sentence
    ]


def _trusted_sentence(fit_verdict: Verdict) -> str:
    """Say that a fit may be trusted, and what speaks a little against it."""
    if fit_verdict.doubts:
        return _IN_DOUBT.format(listed(fit_verdict.doubts))
    if fit_verdict.usable.length is False:
        return _NUMBERS_TRUSTED
    return _LENGTH_TRUSTED if fit_verdict.coefficients_to_leave else _TRUSTED


def suggest_next_step(fit: Record) -> str:
    """Suggest what to do next with a fit that may be trusted; empty where there is nothing."""
    checks, outliers = check_readings(fit), find_outliers(fit)
    if checks is None:
        return ""
    if outliers:
        return f"Next: look at how {_name_reading(outliers[0])} was measured and written down: it is an outlier (see below)."
    if describe_misfits(checks):
        return "Next: look at the noise that is stated for these readings; checks.png shows each of them."
    if rests_on_one_mounting(fit):
        return "Next: remount the cable and repeat a measurement; one mounting cannot show how far mountings differ."
    influential = few(map(_name_reading, checks.influential), most=2)  # how far on each differs from one seed to the next
    noun = "reading" if len(checks.influential) == 1 else "readings"
    remeasure = f"; if in doubt, first repeat the most influential {noun}: {influential}" if influential else ""
    if fit.dataset.description.route is not None and find_optimal_length(fit).is_certain:
        return f"Next: no further measurement is needed{remeasure}. bowdenfit next ranks further measurements."
    if not has_candidates(fit):
        return f"Next: a measurement of another kind, or at other bends, would add more{remeasure}."
    return f"Next: bowdenfit next says which measurement would help most{remeasure}."


def _name_reading(reading: CheckedReading) -> str:
    """Return the name of a reading."""
    return describe_reading(reading.table, reading.label)


def interval_width_caveat(fit: Record) -> str:
    """Say that few readings leave it to a prior how wide intervals are; empty where they do not."""
    checks = check_readings(fit)
    meanings = {p.name: BETWEEN_MOUNTINGS if p.name == RUN_SCATTER else p.meaning for p in fit.model.space.free}
    return describe_assumed_widths(checks, meanings) if checks else ""


def _prior_driven_sentence(fit: Record) -> str:
    """Name the coefficients of friction that no measurement determines."""
    friction = assess_identifiability(fit).groups.get("friction")
    names = friction.resting if friction is not None else []
    return f"Determined mostly by the prior (what was assumed beforehand): {listed(names)}." if names else ""


def _correlation_sentence(fit: Record) -> str:
    """Name the two parameters that are most confounded."""
    pairs = confounded_pairs(fit)
    if not pairs:
        return ""
    pair = pairs[0]
    return f"{pair.first} and {pair.second} are strongly correlated; {pair.combination} is known much better than either."


def _prior_conflict_sentence(fit: Record) -> str:
    """Name the parameters about which readings and prior contradict each other."""
    checks = check_readings(fit)
    pulled = [s.parameter for s in checks.conflicts] if checks else []
    names = dict.fromkeys(pulled + [f.parameter for f in checks.prior_conflicts] if checks else [])
    contradicted = f"The readings contradict the prior of {listed(list(names))} (what was assumed beforehand); check its unit."
    return contradicted if names else ""


def agreement_page(fit: Record) -> list[dict[str, Any]]:
    """Return how well each table agrees with everything else, the most contradictory first."""
    disagreements = sorted(fit.least_squares.disagreements, key=lambda d: -d.conflict)
    return [values_by_key(d) | {"unit": _unit(fit, d)} for d in disagreements]


def describe_contradiction(fit: Record) -> str:
    """Name the table that contradicts the others; empty where all agree."""
    worst = max(fit.least_squares.disagreements, key=lambda d: d.conflict, default=None)
    if worst is None or worst.sds < NOTICEABLE_SDS:
        return ""
    unit, digits = _unit(fit, worst), decimals(worst.others_sd)
    name, *others = (
        find_readings(d.table).table
        for d in (worst, *(d for d in fit.least_squares.disagreements if d is not worst))
        if d.conflict > _COMPARABLE * worst.conflict
    )
    or_else = f" (or {' or '.join(f'that of {other}' for other in others)})" if others else ""
    together = f"{worst.together:z.{digits}f}{unit}"
    return (
        f"The table of {name}{or_else} disagrees with everything else by {worst.sds:.1f} standard deviations: "
        f"without it {worst.parameter} would be {worst.others:z.{digits}f} ± {worst.others_sd:z.{digits}f}{unit}, with it the "
        f"fit is at {together}. Look at the units and wrap angles of that table and at how it was measured: the numbers below "
        "are a compromise between readings that cannot all be right."
    )


def _unit(fit: Record, disagreement: Disagreement) -> str:
    """Return the unit of the parameter, with a blank before it."""
    unit = next(p.unit for p in fit.model.space.free if p.name == disagreement.parameter)
    return "" if unit == "1" else f" {unit}"
