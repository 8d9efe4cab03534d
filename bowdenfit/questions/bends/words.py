"""Answers about stretch, preload and loops at the measured wrap angles, in words and for the report."""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from bowdenfit.description.stated_parameters import PRELOAD
from bowdenfit.display import Block, ResultTable
from bowdenfit.errors import UsageError
from bowdenfit.inference.interval import Interval
from bowdenfit.pages.section import PageSection, PageTable, prose_section
from bowdenfit.questions.bends.answer import ElasticAnswers, elastic_answers, friction_arm, has_elastic_answers
from bowdenfit.questions.bends.bent_cable import find_bent_contact
from bowdenfit.questions.bends.preload_window import PreloadWindow
from bowdenfit.questions.error_budget import with_bench_errors
from bowdenfit.results.record import Record, cached_per_fit
from bowdenfit.words import significant

Cells = tuple[tuple[str, ...], tuple[tuple[str, ...], ...]]
TABLE_HEADING = "Stretch and preload, median (90 % interval)"
_COLUMNS = (
    (
        ("preload", "preload (N)", 3),
        ("friction", "felt in free motion ({unit})", 3),
        ("slack_load", "return side slack from (N)", 3),
    ),
    (
        ("efficiency", "efficiency (%)", 3),
        ("position_error", "position error (mm)", 3),
        ("lost_motion", "lost motion (mm)", 2),
        ("stiffness", "stiffness (N/mm)", 3),
    ),
)
_UNDER_LOAD = {"efficiency", "position_error", "stiffness"}  # answers that depend on the input force
_MAX_CORRELATION = (
    -0.9
)  # of logarithms, below which only the product is reported; a judgement: draws then lie along a line


@dataclass(frozen=True)
class ElasticOverview:
    """Answers about stretch and preload at the measured wrap angles.

    Args:
        input_force: Force at the motor side under which they hold [N].
        friction_unit: Unit of what is felt in free motion.
        bends: One row a wrap angle [deg], with intervals by quantity; in the units that are shown.
        preload_window: The preload window; None where it is not known.
        sentences: Sentences about the preload window, sharp bends, and what the measurements do not separate.
    """

    input_force: float
    friction_unit: str
    bends: tuple[dict[str, Any], ...]
    preload_window: PreloadWindow | None
    sentences: tuple[str, ...]

    JSON: ClassVar = ("input_force", "friction_unit", "bends", "preload_window?", "sentences")


@cached_per_fit
def elastic_overview(fit: Record) -> ElasticOverview | None:
    """Return the answers at the measured wrap angles; None without draws, or of a cable that has none."""
    if fit.sampled is None or not has_elastic_answers(fit):
        return None
    answers, (arm, unit) = elastic_answers(with_bench_errors(fit)), friction_arm(fit)
    bends, draws, window = answers.usual if has_answers_at_bends(fit) else (np.zeros(0), {}, None)
    scale = {"friction": arm, "efficiency": 100.0}
    rows = tuple(
        {"wrap_angle": float(f"{angle:.6g}")}
        | {name: Interval.of(scale.get(name, 1.0) * values[:, i]) for name, values in draws.items()}
        for i, angle in enumerate(np.rad2deg(bends))
    )
    sharp = fit.dataset.description.cable.sharp_bend
    sentences = [window.sentence()] if window is not None else []
    sentences += [f"Warning: {sharp}"] if sharp else []
    return ElasticOverview(
        answers.reference_force, unit, rows, window, (*sentences, *describe_products_with_preload(fit))
    )


def has_answers_at_bends(fit: Record) -> bool:
    """Return whether there are answers at wrap angles, and a wrap angle says which contact is bent."""
    try:
        find_bent_contact(fit.model)
    except UsageError:
        return False
    return has_elastic_answers(fit)


def describe_products_with_preload(fit: Record) -> list[str]:
    """Describe friction coefficients of which only the product with the preload is known, as in free motion."""
    names = [p.name for p in fit.model.space.free]
    if fit.sampled is None or PRELOAD not in names:
        return []
    preload, sentences = fit.posterior.values[PRELOAD].ravel(), []
    for name in (n for n in fit.dataset.description.coefficients if n in names):
        friction = fit.posterior.values[name].ravel()
        if np.corrcoef(np.log(preload), np.log(friction))[0, 1] > _MAX_CORRELATION:
            continue
        product = Interval.of(preload * friction)
        sentences.append(
            f"The measurements barely separate {PRELOAD} from {name}; they determine the product {PRELOAD} x {name} = "
            f"{significant(product.median)} N (90 % interval {significant(product.q05)} to {significant(product.q95)} N)."
        )
    return sentences


def elastic_blocks(answers: ElasticAnswers) -> list[Block]:
    """Describe the answers, or what is missing for them.

    Args:
        answers: The answers of a fit.
    """
    return describe_elastic(answers.fit) or [
        "Nothing measured on this cable determines its stretch or preload, or the fit has no draws; name a table of "
        "stretch, of preload or of the loop in cable.toml."
    ]


def describe_elastic(fit: Record) -> list[Block]:
    """Describe the answers about stretch, preload and the loop, with their intervals; empty where there are none."""
    overview = elastic_overview(fit)
    if overview is None:
        return []
    tables = [ResultTable(*cells) for cells in elastic_tables(overview)]
    return [*([TABLE_HEADING] if tables else []), *tables, *overview.sentences]


def elastic_tables(overview: ElasticOverview) -> list[Cells]:
    """Return heads and rows of the answers at wrap angles; none where the cable has none."""
    tables = [_answer_table(overview, columns) for columns in _COLUMNS] if overview.bends else []
    return [table for table in tables if table is not None]


def _answer_table(overview: ElasticOverview, columns: tuple[tuple[str, str, int], ...]) -> Cells | None:
    """Return some of the answers, a row for each wrap angle; None where the cable has none of them."""
    known = [column for column in columns if column[0] in overview.bends[0]]
    if not known:
        return None
    under = f", {overview.input_force:g} N" if any(key in _UNDER_LOAD for key, _, _ in known) else ""
    heads = (f"at (deg){under}", *(head.format(unit=overview.friction_unit) for _, head, _ in known))
    rows = tuple(
        (f"{bend['wrap_angle']:g}", *(_interval_words(bend[key], digits) for key, _, digits in known))
        for bend in overview.bends
    )
    return heads, rows


def _interval_words(known: Interval, digits: int) -> str:
    """Format a median with its 90 % interval."""
    return f"{significant(known.median, digits)} ({significant(known.q05, digits)} to {significant(known.q95, digits)})"


def section(fit: Record) -> PageSection | None:
    """Return the section of the report; None of a cable without such answers."""
    overview = elastic_overview(fit)
    if overview is None:
        return None
    tables = [PageTable(*cells, TABLE_HEADING) for cells in elastic_tables(overview)]
    return prose_section("Stretch and preload", overview.sentences, tables)
