"""What `bowdenfit calibrate` prints."""

from bowdenfit.questions.calibrate.answer import FEWEST, LEVEL, MOST_UNCONVERGED, Calibration, Checked
from bowdenfit.words import filled, listed, table

_NAMED = 8  # unconverged replications that are named


def calibration_text(found: Calibration) -> str:
    """A calibration for people: the verdict, a table of all quantities, and what was left out."""
    blocks = [
        filled(_what(found)),
        "\n".join(filled(line) for line in _verdict(found)),
        _table(found) if found.quantities else "",
        "\n".join(filled(line) for line in _accounts(found)),
    ]
    return "\n\n".join(block for block in blocks if block) + "\n"


def _what(found: Calibration) -> str:
    """What was done."""
    done = (
        f"{found.name}: {found.replications} times, true values were drawn from the priors, tables like the measured ones were "
        "simulated with them and fitted (seed "
        f"{found.seed})."
    )
    if found.assumed:
        done += f" The fits assumed {listed(found.assumed)}, which the simulated cable does not obey."
    return done


def _verdict(found: Calibration) -> list[str]:
    if not found.is_judged:
        few = f"at least {FEWEST} replications must converge, and at most {MOST_UNCONVERGED:.0%} may fail to"
        return [f"NOT JUDGED: {found.ranked} of {found.replications} replications converged; {few}."]
    if found.is_calibrated:
        return [
            "CALIBRATED: for this description and these tables, intervals hold the truth as often as they claim, as far as "
            f"{found.ranked} replications can tell."
        ]
    lines = ["NOT CALIBRATED: some intervals must not be taken at their word."]
    return lines + [f"- {name}: {fault}." for name, fault in found.faults.items()]


def _table(found: Calibration) -> str:
    heads = ("quantity", "50 % held", "90 % held", "p of ranks", "corrected", "bias", "shrinkage", "")
    rows = [_row(q) for q in found.quantities]
    first = found.quantities[0].coverage
    bands = listed([f"{c.low:.0%} and {c.high:.0%} of the {c.probability:.0%} intervals" for c in first])
    note = (
        f"Held: share of the intervals that hold the truth; by chance alone all quantities lie between {bands} in "
        f"{1 - LEVEL:.0%} of calibrations. p of ranks: chance of ranks this far from uniform; corrected for the number of "
        f"quantities, below {LEVEL:g} counts as wrong. Bias: posterior mean less truth, in posterior standard deviations. "
        "Shrinkage: 0 where the data say nothing beyond the prior, 1 where they say all."
    )
    return table(heads, rows) + "\n\n" + filled(note)


def _row(q: Checked) -> tuple[str, ...]:
    half, wide = q.coverage
    return (
        q.name, f"{half.rate:.1%}", f"{wide.rate:.1%}", f"{q.p_value:.3f}", f"{q.corrected:.3f}",
        f"{q.bias:+.2f} +- {q.bias_error:.2f}", f"{q.shrinkage:.2f}", "" if q.is_calibrated else "wrong",
    )  # fmt: skip


def _accounts(found: Calibration) -> list[str]:
    """What was left out, and why."""
    lines = [f"A replication took {found.seconds:.1f} s (median)."]
    if found.redrawn:
        n = sum(found.redrawn.values())
        why = listed(
            [f"{reason} ({count})" for reason, count in sorted(found.redrawn.items(), key=lambda item: -item[1])]
        )
        lines.append(
            f"{n} simulated data sets were drawn again, truth and tables together, because no bench would hand them in: {why}. "
            "The rule looks at the simulated readings alone, so it leaves the ranks uniform."
        )
    if found.unconverged:
        numbers = list(found.unconverged)
        named = ", ".join(str(n) for n in numbers[:_NAMED]) + (" ..." if len(numbers) > _NAMED else "")
        first = found.unconverged[numbers[0]]
        lines.append(
            f"{len(numbers)} replications did not converge and are not ranked (numbers {named}), such as {numbers[0]}: {first}."
        )
    return lines
