"""What `bowdenfit calibrate` prints."""

import math

from bowdenfit.display import text_of
from bowdenfit.questions.calibrate.answer import FEWEST, LEVEL, MOST_UNCONVERGED, Calibration, Checked
from bowdenfit.words import counted, filled, legend, listed, percent, significant, table

HEADS = ("quantity", "50 % held", "90 % held", "bias", "")
EVIDENCE_HEADS = ("quantity", "p of ranks", "corrected", "shrinkage")
_NAMED = 8  # unconverged replications that are named


@text_of.register(Calibration)
def calibration_text(found: Calibration) -> str:
    """A calibration for people: the verdict, a table of all quantities, and what was left out."""
    blocks = [
        "\n".join(filled(line) for line in verdict_sentences(found)),
        filled(what_was_done(found)),
        f"{table(HEADS, rows(found))}\n\n{filled(how_to_read(found))}" if found.quantities else "",
        legend({q.name: q.meaning for q in found.quantities}),
        "\n".join(filled(line) for line in account_sentences(found)),
    ]
    return "\n\n".join(block for block in blocks if block) + "\n"


def details_text(found: Calibration) -> str:
    """All of a calibration (`details.txt`): what is printed, then what the verdict on each quantity rests on."""
    if not found.quantities:
        return calibration_text(found)
    evidence = f"{table(EVIDENCE_HEADS, evidence_rows(found))}\n\n{filled(how_to_read_evidence(found))}"
    return f"{calibration_text(found)}\n{evidence}\n"


def what_was_done(found: Calibration) -> str:
    """What was done."""
    of_rest = f"were stated ({listed(found.truths)}), the others drawn from the priors" if found.truths else ""
    done = (
        f"{found.name}: {found.replications} times, true values {of_rest or 'were drawn from the priors'}, tables like the "
        f"measured ones were simulated with them and fitted (seed {found.seed})."
    )
    if found.assumed:
        done += f" The fits assumed {listed(found.assumed)}, which the simulated cable does not obey."
    return done


def verdict_sentences(found: Calibration) -> list[str]:
    """Whether intervals hold the truth as often as they claim, and which do not."""
    if not found.is_judged:
        few = f"at least {FEWEST} replications must converge, and at most {percent(MOST_UNCONVERGED, 0)} may fail to"
        return [f"NOT JUDGED: {found.ranked} of {found.replications} replications converged; {few}."]
    whose = "intervals of the coefficients and of the optimum" if found.truths else "intervals"
    if found.is_calibrated:
        return [
            f"CALIBRATED: for this description and these tables, {whose} hold the truth as often as they claim, as far as "
            f"{found.ranked} replications can tell.",
            _power(found),
        ]
    lines = ["NOT CALIBRATED: some intervals must not be taken at their word."]
    return [*lines, *(f"- {name}: {fault}." for name, fault in found.faults.items()), _power(found)]


def _power(found: Calibration) -> str:
    """What so many replications can see."""
    seen = listed([f"too small by {percent(p.too_small, 0)} with probability {p.caught:.2f}" for p in found.power])
    return f"Of one quantity, intervals {seen} are caught by {found.ranked} replications."


def rows(found: Calibration) -> list[tuple[str, ...]]:
    """Every quantity, under `HEADS`."""
    return [_row(q) for q in found.quantities]


def how_to_read(found: Calibration) -> str:
    """What stands under `HEADS`."""
    first = found.quantities[0].coverage
    bands = listed(
        [f"{percent(c.low, 0)} and {percent(c.high, 0)} of the {percent(c.probability, 0)} intervals" for c in first]
    )
    note = (
        f"Held: share of the intervals that hold the truth; by chance alone all {'judged ' if found.truths else ''}quantities "
        f"lie between {bands} in {percent(1 - LEVEL, 0)} of calibrations. "
    )
    if found.truths:
        note += (
            "Noise scales and the like, in brackets, are not judged: their intervals may lean on what was assumed beforehand. "
        )
    else:
        note += "Whether truths lie evenly within what the fits say is judged too. "
    return note + "Bias: estimate less truth, in standard deviations of the estimate."


def evidence_rows(found: Calibration) -> list[tuple[str, ...]]:
    """Every quantity, under `EVIDENCE_HEADS`."""
    return [
        (
            q.name, f"{q.p_value:.3f}", f"{q.corrected:.3f}" if q.judged_by else "",
            "" if math.isnan(q.shrinkage) else f"{q.shrinkage:.2f}",
        )
        for q in found.quantities
    ]  # fmt: skip


def how_to_read_evidence(found: Calibration) -> str:
    """What stands under `EVIDENCE_HEADS`."""
    judged = "not judged, because truths are not of the prior" if found.truths else f"below {LEVEL} counts as wrong"
    return (
        "p of ranks: chance of ranks of the truth this far from uniform; corrected (Holm) for the number of quantities, "
        f"{judged}. Shrinkage: 0 where the data say nothing beyond the prior, 1 where they say all."
    )


def _row(q: Checked) -> tuple[str, ...]:
    half, wide = q.coverage
    return (
        q.name if q.judged_by else f"({q.name})", percent(half.rate), percent(wide.rate),
        f"{q.bias:+.2f} ± {q.bias_error:.2f}", "" if q.is_calibrated else "wrong",
    )  # fmt: skip


def _with_all(found: Calibration) -> str:
    """What would be said if those that did not converge were ranked too."""
    if found.faults_with_all == found.faults:
        return "Ranked as far as they came, they would change nothing."
    wrong = [f"{name} ({fault})" for name, fault in found.faults_with_all.items()]
    says = f"wrong would be {listed(wrong)}" if wrong else "nothing would be wrong"
    return f"Ranked with them, as far as they came, {says}."


def _unranked(numbers: list[int]) -> str:
    """Which replications are not ranked, up to the reason of the first."""
    if len(numbers) == 1:
        return f"1 replication did not converge and is not ranked, number {numbers[0]}"
    named = ", ".join(str(n) for n in numbers[:_NAMED]) + (" ..." if len(numbers) > _NAMED else "")
    return f"{len(numbers)} replications did not converge and are not ranked (numbers {named}), such as {numbers[0]}"


def account_sentences(found: Calibration) -> list[str]:
    """How long it took, what was left out, and why."""
    lines = [f"A replication took {significant(found.seconds, 2)} s (median)."]
    if found.engines:
        words = {
            "laplace": "importance sampling",
            "ensembles": "full sampling",
            "nuts": "sampling by gradients",
        }
        lines[0] += f" Fitted by {listed([f'{words.get(name, name)} ({n})' for name, n in found.engines.items()])}."
    if found.redrawn:
        n = sum(found.redrawn.values())
        why = listed(
            [f"{reason} ({count})" for reason, count in sorted(found.redrawn.items(), key=lambda item: -item[1])]
        )
        lines.append(
            f"{counted(n, 'simulated data set was', 'simulated data sets were')} drawn again, truth and tables together, "
            f"because no bench would hand {'it' if n == 1 else 'them'} in: {why}. "
            "The rule looks at the simulated readings alone"
            f"{', whatever the truth is' if found.truths else ', so it leaves the ranks uniform'}."
        )
    if found.unconverged:
        numbers = list(found.unconverged)
        first = found.unconverged[numbers[0]]
        lines.append(
            f"{_unranked(numbers)}: {first}. Whether a fit converges follows from the readings, whatever the truth is, so that "
            f"leaving some out leaves ranks uniform. {_with_all(found)}"
        )
    return lines
