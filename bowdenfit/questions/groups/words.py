"""Contrasts between groups in words."""

from bowdenfit.questions.groups.answer import contrast_groups
from bowdenfit.results.record import Record
from bowdenfit.words import filled, listed


def groups_text(fit: Record) -> str:
    """The contrasts of a fit, a line each; empty without groups or draws."""
    groups = contrast_groups(fit)
    if groups is None:
        return ""
    several = len({c.coefficient for c in groups.contrasts}) > 1
    lines = [f"  {f'{c.coefficient}, ' if several else ''}{c.sentence()}" for c in groups.contrasts]
    what = listed(list(dict.fromkeys(c.coefficient for c in groups.contrasts)))
    note = (
        "The probability is that of the sign, which is 0.5 where nothing is known. "
        f"Efficiencies{' and the best length' if fit.dataset.description.route else ''} that name no group are of the group "
        f"{groups.predicted}; --set group=NAME asks for another."
    )
    return "\n".join([f"Friction of the groups, {what}", *lines, filled(note)])
