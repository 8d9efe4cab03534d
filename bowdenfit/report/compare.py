"""What `bowdenfit compare` prints."""

from bowdenfit.report.layout import filled, listed, table
from bowdenfit.results.answers import Interval, decimals
from bowdenfit.results.comparison import Comparison


def comparison_text(found: Comparison) -> str:
    """A comparison for people: which fit predicts best, what changes between them, and what speed does."""
    heads = ("fit", "model", "elpd less than the best", "standard error")
    rows = [
        (name, found.described[name], f"{d.elpd:.1f}", "" if d.elpd == 0 else f"{d.standard_error:.1f}")
        for name, d in found.differences.items()
    ]
    blocks = [
        "How well each predicts a reading left out\n" + table(heads, rows, left=("model",)),
        "\n".join(filled(line) for line in _verdict(found)),
        _parameters(found),
        "\n".join(filled(line) for line in _speed(found)),
    ]
    return "\n\n".join(block for block in blocks if block) + "\n"


def _verdict(found: Comparison) -> list[str]:
    best, *others = found.differences
    seen = [name for name in others if found.differences[name].is_seen]
    alike = [name for name in others if name not in seen]
    lines = []
    if seen:
        lines.append(f"{best} predicts better than {listed(seen)}, by more than chance would give.")
    if alike:
        lines.append(
            f"The data cannot tell {best} from {listed(alike)}: the difference is within what chance gives. Prefer the "
            "simpler one."
        )
    doubtful = max(d.unreliable for d in found.differences.values())
    if doubtful:
        lines.append(
            f"For {doubtful} reading{'s' if doubtful > 1 else ''} the estimate leans on few draws (Pareto k above 0.7): take "
            "the differences as rough."
        )
    return lines


def _parameters(found: Comparison) -> str:
    names = list(found.differences)
    rows = [(p, *(_shown(row.get(name)) for name in names)) for p, row in found.parameters.items()]
    rows += (
        [("optimal length", *(_shown(found.optimal_length[n][0], found.optimal_length[n][1]) for n in names))]
        if len(found.optimal_length) == len(names)
        else []
    )
    return "What changes, mean +- sd\n" + table(("parameter", *names), rows)


def _shown(interval: Interval | None, unit: str = "") -> str:
    if interval is None:
        return "-"
    digits = decimals(interval.sd)
    return f"{interval.mean:.{digits}f} +- {interval.sd:.{digits}f}" + (f" {unit}" if unit else "")


def _speed(found: Comparison) -> list[str]:
    """The answer on speed, from every fit that allows it."""
    lines = [f"{name}: {effect.sentence()}" for name, effect in found.rate_effects.items()]
    without = [name for name in found.differences if name not in found.rate_effects]
    for name in found.rate_effects:
        for plain in without:
            better = found.differences[plain].elpd - found.differences[name].elpd
            if better <= 0 or not found.differences[plain].is_seen:
                lines.append(f"Letting friction depend on speed ({name}) predicts no better than not ({plain}).")
            else:
                lines.append(f"Letting friction depend on speed ({name}) predicts better than not ({plain}).")
    return lines
