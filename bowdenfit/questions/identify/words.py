"""What `bowdenfit identify` prints."""

from bowdenfit.inference.identifiability import OWN, RESTS_ON_PRIOR, Combination, Knowledge, Known
from bowdenfit.questions.identify.answer import CURVES, Identifiability
from bowdenfit.words import decimals, filled, percent, table

_HARD = 1000.0  # condition number beyond which parameters are hardly told apart


def identifiability_text(found: Identifiability) -> str:
    """What measurements determine, for people: the sentence first, then parameters and combinations."""
    blocks = [
        f"{found.name}\n{'=' * len(found.name)}\n" + filled(f"Judged at {found.basis}."),
        "\n".join(filled(sentence) for sentence in found.sentences()),
    ]
    for name, group in found.groups.items():
        blocks.append(_parameters(name, group))
        if name != CURVES:
            blocks.append(_directions(group))
    blocks.append(
        filled(
            "Known to: one standard deviation. Prior alone: the same before any measurement. Collinear: how "
            "much larger the variance is than if all the others were known."
        )
    )
    return "\n\n".join(block for block in blocks if block) + "\n"


def _parameters(name: str, group: Knowledge) -> str:
    heads = ("parameter", "value", "known to", "prior alone", "informed by", "most alike", "collinear")
    rows = [(p.name, *_numbers(p), _informed(p.share), _alike(p), f"{p.inflation:.3g}") for p in group.parameters]
    said = f"{name[0].upper() + name[1:]}, one by one\n" + table(heads, rows, left=("informed by",))
    if len(group.parameters) > 1 and not group.collinearity < _HARD:
        shown = "infinite" if group.collinearity == float("inf") else f"{group.collinearity:.2g}"
        said += "\n" + filled(f"Condition number of their information: {shown}; they are hardly told apart.")
    return said


def _numbers(p: Known) -> tuple[str, str, str]:
    digits = decimals(p.sd)
    return f"{p.value:.{digits}f}", f"± {p.sd:.{digits}f}", f"± {p.prior_sd:.{digits}f}"


def _informed(share: float) -> str:
    """Who speaks: measurements or prior."""
    if share < OWN:
        return f"measurements ({percent(1 - share, 0)})"
    return f"prior ({percent(share, 0)})" if share > RESTS_ON_PRIOR else f"both (prior {percent(share, 0)})"


def _alike(p: Known) -> str:
    return f"{p.most_alike} ({p.correlation:+.2f})" if p.most_alike else "-"


def _directions(group: Knowledge) -> str:
    """Independent combinations, the best determined first; of a single parameter there is nothing more to say."""
    if len(group.directions) < 2:
        return ""
    heads = ("combination", "value", "known to", "information (prior = 1)")
    rows = [(d.words, *_sum(d), f"{d.information:.3g}") for d in group.directions]
    return "Independent combinations, the best determined first\n" + table(heads, rows)


def _sum(d: Combination) -> tuple[str, str]:
    digits = decimals(d.sd)
    return f"{d.value:.{digits}f}", f"± {d.sd:.{digits}f}"
