"""What `bowdenfit metabolic` prints."""

from bowdenfit.display import text_of
from bowdenfit.questions.metabolic.answer import ConditionDifference, Metabolic
from bowdenfit.words import counted, filled, narrow_table, percent


@text_of.register(Metabolic)
def metabolic_text(result: Metabolic) -> str:
    """A study for people: what it shows, what it does not, and what of it cannot be right."""
    heads = ("condition", "less", "W/kg", "95 % from", "to", "change", "p", "p (Holm)", "lower with prob.")
    rows = [
        (c.condition, c.less, f"{c.difference:+.3f}", f"{c.low:+.3f}", f"{c.high:+.3f}", percent(c.share, sign="+"),
         f"{c.p:.2g}", f"{c.p_holm:.2g}", f"{c.lower_doubted:.2f} to {c.lower:.2f}")
        for c in result.comparisons
    ]  # fmt: skip
    blocks = [
        "\n".join(filled(line) for line in (f"{result.name}:", *map(_difference_sentence, result.comparisons))),
        narrow_table(heads, rows, left=("less",)),
        "\n".join(filled(f"- {line}") for line in result.contradictions),
        "\n".join(filled(line) for line in _remarks(result)),
    ]
    if result.contradictions:
        blocks[2] = f"Numbers that cannot all be right\n{blocks[2]}"
    return "\n\n".join(block for block in blocks if block) + "\n"


def _difference_sentence(comparison: ConditionDifference) -> str:
    """Whether a difference is shown."""
    way = "lower" if comparison.difference < 0 else "higher"
    size = f"{abs(comparison.difference):.2f} W/kg ({percent(abs(comparison.share))})"
    if comparison.is_significant:
        return (
            f"{comparison.condition} is {way} than {comparison.less} by {size}; the difference is significant "
            f"(p = {comparison.p_holm:.2g}, adjusted for all pairs)."
        )
    needed = f"{comparison.needed} persons would" if comparison.needed else "no realistic number of persons would"
    return (
        f"{comparison.condition} is not shown to be {way} than {comparison.less}: {size} with {comparison.persons} "
        f"persons, p = {comparison.p:.2g}; "
        f"{needed} show a difference as large in four of five studies."
    )


def _remarks(result: Metabolic) -> list[str]:
    """What the numbers hold for."""
    lines = []
    if result.order:
        lines.append(
            f"All walked in the same order ({', '.join(result.order)}), so what changes with time, such as getting used to the "
            "device or tiring, cannot be separated from the effect of the conditions."
        )
    persons = counted(max(comparison.persons for comparison in result.comparisons), "person")
    least = max(result.comparisons, key=lambda comparison: comparison.least)
    lines.append(
        f"With {persons} the least true difference that four of five studies find is {least.least:.2f} W/kg "
        f"({least.condition} less {least.less})."
    )
    lines.append(
        "Lower with probability: the first number assumes beforehand that differences are a few percent either way, the "
        "second assumes nothing."
    )
    if not result.from_persons:
        lines.append("Each person's numbers were not printed; all follows from printed means and probabilities.")
    return lines
