"""What `bowdenfit metabolic` prints."""

from bowdenfit.display import text_of
from bowdenfit.questions.metabolic.answer import Comparison, Metabolic
from bowdenfit.words import counted, filled, narrow_table, percent


@text_of.register(Metabolic)
def metabolic_text(found: Metabolic) -> str:
    """A study for people: what it shows, what it does not, and what of it cannot be right."""
    heads = ("condition", "less", "W/kg", "95 % from", "to", "change", "p", "p (Holm)", "lower with prob.")
    rows = [
        (each.condition, each.less, f"{each.difference:+.3f}", f"{each.low:+.3f}", f"{each.high:+.3f}",
         percent(each.share, sign="+"), f"{each.p:.2g}", f"{each.p_holm:.2g}", f"{each.lower_doubted:.2f} to {each.lower:.2f}")
        for each in found.comparisons
    ]  # fmt: skip
    blocks = [
        "\n".join(filled(line) for line in (f"{found.name}:", *map(_sentence, found.comparisons))),
        narrow_table(heads, rows, left=("less",)),
        "\n".join(filled(f"- {line}") for line in found.contradictions),
        "\n".join(filled(line) for line in _remarks(found)),
    ]
    if found.contradictions:
        blocks[2] = f"Numbers that cannot all be right\n{blocks[2]}"
    return "\n\n".join(block for block in blocks if block) + "\n"


def _sentence(each: Comparison) -> str:
    """Whether a difference is shown."""
    way = "lower" if each.difference < 0 else "higher"
    size = f"{abs(each.difference):.2f} W/kg ({percent(abs(each.share))})"
    if each.shown:
        return f"{each.condition} is {way} than {each.less} by {size}; that is no chance (p = {each.p_holm:.2g} for all pairs)."
    needed = f"{each.needed} persons would" if each.needed else "no number of persons that can be had would"
    return (
        f"{each.condition} is not shown to be {way} than {each.less}: {size} with {each.persons} persons, p = {each.p:.2g}; "
        f"{needed} show a difference as large in four of five studies."
    )


def _remarks(found: Metabolic) -> list[str]:
    """What the numbers hold for."""
    lines = []
    if found.order:
        lines.append(
            f"All walked in the same order ({', '.join(found.order)}), so what changes with time, such as getting used to the "
            "device or tiring, cannot be told from what the conditions do."
        )
    persons = counted(max(each.persons for each in found.comparisons), "person")
    least = max(found.comparisons, key=lambda each: each.least)
    lines.append(
        f"With {persons} the least true difference that four of five studies find is {least.least:.2f} W/kg "
        f"({least.condition} less {least.less})."
    )
    lines.append(
        "Lower with probability: the first number is of one who expected differences of a few percent either way, the second "
        "of one who knew nothing."
    )
    if not found.from_persons:
        lines.append("Each person's numbers were not printed; all follows from printed means and probabilities.")
    return lines
