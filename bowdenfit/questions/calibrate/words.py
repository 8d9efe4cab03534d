"""A calibration for people: as text, as a page, and the figures that go with it."""

import math
from pathlib import Path

from bowdenfit.display import Block, Legend, ResultTable, blocks_of, render_text, separate
from bowdenfit.pages.section import HtmlPage, PageTable, Picture, make_meanings_table, prose_section
from bowdenfit.questions.calibrate import coverage_figure, ranks_figure, sharpness_figure
from bowdenfit.questions.calibrate.answer import LEVEL, MAX_UNCONVERGED, MIN_REPLICATIONS, Calibration, CheckedQuantity
from bowdenfit.questions.figure_files import AnswerFigure, write_figure
from bowdenfit.words import counted, listed, percent, significant

HEADS = ("quantity", "50 % held", "90 % held", "bias", "")
EVIDENCE_HEADS = ("quantity", "p of ranks", "corrected", "shrinkage")
FOLDED = ("ranks", "sharpness")  # figures for statisticians
_MAX_NAMED = 8  # unconverged replications that are named; a judgement


@blocks_of.register(Calibration)
def calibration_blocks(calibration: Calibration) -> list[Block]:
    """Return a calibration for people: the verdict, a table of all quantities, and what was left out."""
    quantities = calibration.quantities
    return separate(
        verdict_sentences(calibration),
        [describe_procedure(calibration)],
        [ResultTable(HEADS, quantity_rows(calibration))] if quantities else [],
        [quantity_note(calibration)] if quantities else [],
        [Legend({q.name: q.meaning for q in quantities})],
        omission_sentences(calibration),
    )


def details_text(calibration: Calibration) -> str:
    """Return all of a calibration (`details.txt`): what is printed, then what the verdict on each quantity rests on."""
    blocks = calibration_blocks(calibration)
    if calibration.quantities:
        blocks += ["", ResultTable(EVIDENCE_HEADS, evidence_rows(calibration)), "", evidence_note(calibration)]
    return render_text(blocks)


def calibration_page(calibration: Calibration) -> HtmlPage:
    """Return a calibration as a page: whether intervals contain the truth, quantity by quantity, and what was left out.

    Args:
        calibration: The calibration.
    """
    first, *others = verdict_sentences(calibration)
    table = [PageTable(HEADS, tuple(quantity_rows(calibration)))] if calibration.quantities else []
    evidence = PageTable(EVIDENCE_HEADS, tuple(evidence_rows(calibration)), evidence_note(calibration))
    names = make_meanings_table({quantity.name: quantity.meaning for quantity in calibration.quantities})
    sections = (
        prose_section("The answer", [*others, describe_procedure(calibration)], headline=first),
        prose_section(
            "Quantity by quantity", [quantity_note(calibration)] if table else [], table,
            folded=[("What the names mean", names), ("What the verdict on each rests on", evidence)],
            pictures=_make_pictures(calibration),
        ),
        prose_section("What was left out", omission_sentences(calibration)),
    )  # fmt: skip
    return HtmlPage(calibration.name, "Calibration by bowdenfit", sections)


def _make_pictures(calibration: Calibration) -> tuple[Picture, ...]:
    """Return the figures with their captions, those for statisticians folded."""
    figures = select_figures(calibration).items()
    return tuple(
        Picture(name, figure.HEADING, figure.caption(calibration), folded=name in FOLDED) for name, figure in figures
    )


def select_figures(calibration: Calibration) -> dict[str, AnswerFigure]:
    """Return the figures that a calibration has something to show in, by their names, in the order in which they are read."""
    if not calibration.quantities:
        return {}
    always: dict[str, AnswerFigure] = {"coverage": coverage_figure}
    if calibration.truths:  # ranks need not be uniform then, and there is no prior variance to compare with
        return always
    return always | {"ranks": ranks_figure, "sharpness": sharpness_figure}


def draw_calibration(calibration: Calibration, folder: Path) -> list[Path]:
    """Draw and write all figures of a calibration, and what each shows in words.

    Args:
        calibration: The calibration.
        folder: Where the files go; made if it is missing.
    """
    figures = select_figures(calibration).items()
    return [
        path for name, figure in figures for path in write_figure(figure, calibration, folder, name, calibration.name)
    ]


def describe_procedure(calibration: Calibration) -> str:
    """Say what was done."""
    stated = (
        f"were stated ({listed(calibration.truths)}), the others drawn from the priors" if calibration.truths else ""
    )
    done = (
        f"{calibration.name}: {calibration.replications} times, true values {stated or 'were drawn from the priors'}, "
        "tables like the "
        f"measured ones were simulated with them and fitted (seed {calibration.seed})."
    )
    if calibration.assumed:
        done += f" The fits assumed {listed(calibration.assumed)}, which the simulated cable does not obey."
    return done


def verdict_sentences(calibration: Calibration) -> list[str]:
    """Say whether intervals contain the truth as often as they claim, and which do not."""
    if not calibration.is_conclusive:
        few = f"at least {MIN_REPLICATIONS} replications must converge, and at most {percent(MAX_UNCONVERGED, 0)} may fail to"
        return [f"NOT JUDGED: {calibration.ranked} of {calibration.replications} replications converged; {few}."]
    whose = "intervals of the coefficients and of the optimum" if calibration.truths else "intervals"
    if calibration.is_calibrated:
        return [
            f"CALIBRATED: for this description and these tables, {whose} contain the truth as often as they claim, as far as "
            f"{calibration.ranked} replications can show.",
            _power_sentence(calibration),
        ]
    lines = ["NOT CALIBRATED: some intervals do not contain the truth as often as they claim."]
    return [
        *lines,
        *(f"- {name}: {fault}." for name, fault in calibration.faults.items()),
        _power_sentence(calibration),
    ]


def _power_sentence(calibration: Calibration) -> str:
    """Say what so many replications can see."""
    detected = listed([f"by {percent(p.too_small, 0)} with probability {p.caught:.2f}" for p in calibration.power])
    return f"For a single quantity, {calibration.ranked} replications would detect intervals that are too small {detected}."


def quantity_rows(calibration: Calibration) -> list[tuple[str, ...]]:
    """Return a row for every quantity, under `HEADS`."""
    return [_quantity_row(q) for q in calibration.quantities]


def quantity_note(calibration: Calibration) -> str:
    """Return what stands under the table of `HEADS`."""
    first = calibration.quantities[0].coverage
    bands = listed(
        [f"{percent(c.low, 0)} and {percent(c.high, 0)} of the {percent(c.probability, 0)} intervals" for c in first]
    )
    note = (
        "Held: share of the intervals that contain the truth; by chance alone all "
        f"{'judged ' if calibration.truths else ''}quantities "
        f"lie between {bands} in {percent(1 - LEVEL, 0)} of calibrations. "
    )
    if calibration.truths:
        note += "Noise scales and the like, in brackets, are not judged: their intervals may depend on their priors. "
    else:
        note += "Whether true values fall evenly within their estimated distributions is judged too. "
    return note + "Bias: estimate minus truth, in standard deviations of the estimate."


def evidence_rows(calibration: Calibration) -> list[tuple[str, ...]]:
    """Return a row for every quantity, under `EVIDENCE_HEADS`."""
    return [
        (
            q.name, f"{q.p_value:.3f}", f"{q.corrected:.3f}" if q.judged_by else "",
            "" if math.isnan(q.shrinkage) else f"{q.shrinkage:.2f}",
        )
        for q in calibration.quantities
    ]  # fmt: skip


def evidence_note(calibration: Calibration) -> str:
    """Return what stands under the table of `EVIDENCE_HEADS`."""
    criterion = (
        "not judged, because truths are not of the prior" if calibration.truths else f"below {LEVEL} counts as wrong"
    )
    return (
        "p of ranks: probability that uniform ranks would be this far from uniform; corrected (Holm) for the number of "
        f"quantities, {criterion}. "
        "Shrinkage (posterior contraction): 0 where the data add nothing to the prior, 1 where they determine the value "
        "completely."
    )


def _quantity_row(q: CheckedQuantity) -> tuple[str, ...]:
    half, wide = q.coverage
    return (
        q.name if q.judged_by else f"({q.name})", percent(half.rate), percent(wide.rate),
        f"{q.bias:+.2f} ± {q.bias_error:.2f}", "" if q.is_calibrated else "wrong",
    )  # fmt: skip


def _describe_with_unconverged(calibration: Calibration) -> str:
    """Say what would be wrong if replications that did not converge were ranked too."""
    if calibration.faults_with_all == calibration.faults:
        return "Counted as they are, they would change nothing."
    wrong = [f"{name} ({fault})" for name, fault in calibration.faults_with_all.items()]
    return f"With them, counted as they are, {listed(wrong) if wrong else 'nothing'} would be wrong."


def _describe_unconverged(numbers: list[int]) -> str:
    """Say which replications are not ranked, up to the reason of the first."""
    if len(numbers) == 1:
        return f"1 replication did not converge and is not ranked, number {numbers[0]}"
    named = ", ".join(str(n) for n in numbers[:_MAX_NAMED]) + (" ..." if len(numbers) > _MAX_NAMED else "")
    return f"{len(numbers)} replications did not converge and are not ranked (numbers {named}), such as {numbers[0]}"


def omission_sentences(calibration: Calibration) -> list[str]:
    """Say how long it took, what was left out, and why."""
    lines = [f"A replication took {significant(calibration.seconds, 2)} s (median)."]
    if calibration.engines:
        words = {
            "laplace": "importance sampling",
            "ensembles": "full sampling",
            "nuts": "NUTS",
        }
        lines[0] += (
            f" Fitted by {listed([f'{words.get(name, name)} ({n})' for name, n in calibration.engines.items()])}."
        )
    if calibration.redrawn:
        n = sum(calibration.redrawn.values())
        cause = listed(
            [f"{reason} ({count})" for reason, count in sorted(calibration.redrawn.items(), key=lambda item: -item[1])]
        )
        lines.append(
            f"{counted(n, 'simulated data set was', 'simulated data sets were')} drawn again, truth and tables together, "
            f"because no bench would produce {'it' if n == 1 else 'them'}: {cause}. "
            "The rule looks at the simulated readings alone"
            f"{', whatever the truth is' if calibration.truths else ', so it leaves the ranks uniform'}."
        )
    if calibration.unconverged:
        numbers = list(calibration.unconverged)
        first = calibration.unconverged[numbers[0]]
        lines.append(
            f"{_describe_unconverged(numbers)}: {first}. Whether a fit converges follows from the readings, whatever "
            "the truth is, so that "
            f"leaving some out leaves ranks uniform. {_describe_with_unconverged(calibration)}"
        )
    return lines
