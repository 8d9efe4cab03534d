"""What changed between an earlier fit and this one: inputs, what was assumed, verdict, and every answer beside the other."""

from collections.abc import Iterator, Mapping
from pathlib import PurePath
from typing import Any

from bowdenfit.inference.interval import Interval
from bowdenfit.pages.section import PageSection, PageTable, prose_section
from bowdenfit.questions.summary.brief import key_quantities
from bowdenfit.questions.summary.verdict import assess_fit
from bowdenfit.results.record import OPTIMAL_EFFICIENCY, OPTIMAL_LENGTH, Record
from bowdenfit.words import few, listed, shown

TITLE = "What changed"
_MOST = 6  # settings that are named one by one
_HEADS = ("quantity", "unit", "earlier", "now")


def changes_section(fit: Record, earlier: Record, name: str) -> PageSection:
    """Return what changed since an earlier fit.

    Args:
        fit: This fit.
        earlier: The other.
        name: Name of the earlier one, such as its folder.
    """
    when = f", of {earlier.provenance.created[:10]}" if earlier.provenance.created else ""
    sentences = [
        f"Compared with the earlier fit {PurePath(name).name or name}{when}.",
        _describe_inputs(fit, earlier),
        _describe_settings(fit, earlier),
        _describe_verdicts(fit, earlier),
    ]
    return prose_section(TITLE, sentences, [PageTable(_HEADS, tuple(_compare_quantities(fit, earlier)), left=(0, 1))])


def _describe_inputs(fit: Record, earlier: Record) -> str:
    """Say which input files are others, or have other contents."""
    now, before = fit.dataset.sha256, earlier.dataset.sha256
    added, gone = sorted(now.keys() - before.keys()), sorted(before.keys() - now.keys())
    changed = sorted(name for name in now.keys() & before.keys() if now[name] != before[name])
    verbs = {"New": added, "No longer read": gone, "Changed": changed}
    parts = [f"{what}: {few(names, _MOST)}." for what, names in verbs.items() if names]
    return " ".join(parts) if parts else "The input files are the same."


def _describe_settings(fit: Record, earlier: Record) -> str:
    """Say which settings of the description differ."""
    now, before = (dict(_flatten(one.dataset.description.to_json())) for one in (fit, earlier))
    keys = sorted(key for key in now.keys() | before.keys() if now.get(key) != before.get(key))
    if not keys:
        return "" if fit.provenance.seed == earlier.provenance.seed else "Only the seed differs in what was assumed."
    differences = [f"{key} is {_show(now.get(key))}, was {_show(before.get(key))}" for key in keys[:_MOST]]
    more = f"; {len(keys) - _MOST} settings more differ" if len(keys) > _MOST else ""
    return f"In the description: {'; '.join(differences)}{more}."


def _flatten(page: Any, key: str = "") -> Iterator[tuple[str, Any]]:
    """Yield dotted keys and plain values of nested tables."""
    if isinstance(page, Mapping):
        for name, value in page.items():
            yield from _flatten(value, f"{key}.{name}" if key else str(name))
    else:
        yield key, page


def _show(value: Any) -> str:
    return "not stated" if value is None else shown(value)


def _describe_verdicts(fit: Record, earlier: Record) -> str:
    trusted = [assess_fit(one).trusted for one in (earlier, fit)]
    if trusted[0] == trusted[1]:
        return "Both may be trusted." if all(trusted) else "Neither may be trusted."
    return f"The {'earlier one' if trusted[0] else 'new one'} alone may be trusted."


def _compare_quantities(fit: Record, earlier: Record) -> Iterator[tuple[str, ...]]:
    """Yield name, unit, and what each fit says of every coefficient and of the best length."""
    now, before = ({quantity.name: quantity for quantity in key_quantities(one)} for one in (fit, earlier))
    for name, quantity in (before | now).items():
        values = [f"{one[name].value} ({one[name].interval})" if name in one else "-" for one in (before, now)]
        yield (name, quantity.unit, *values)
    routes = [one.dataset.description.route for one in (fit, earlier)]
    for name in (OPTIMAL_LENGTH, OPTIMAL_EFFICIENCY):
        optima = [_optimum(one, name) for one in (earlier, fit)]
        if any(optima):
            units = {route.unit for route in routes if route is not None} if name == OPTIMAL_LENGTH else {""}
            yield (name, listed(sorted(units)), *(_format(one) for one in optima))


def _optimum(fit: Record, name: str) -> Interval | None:
    draws = fit.sampled.optimum.get(name) if fit.sampled is not None else None
    return None if draws is None else Interval.of(draws)


def _format(interval: Interval | None) -> str:
    if interval is None:
        return "-"
    return f"{interval.median:z.{interval.digits}f} ({interval.range_text(interval.digits)})"
