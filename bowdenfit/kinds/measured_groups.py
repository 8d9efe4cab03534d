"""The groups of a data set's readings, which may have friction coefficients of their own."""

from bowdenfit.description import BY_GROUP, Description
from bowdenfit.errors import DescriptionError, suggest_name
from bowdenfit.kinds import each_table
from bowdenfit.kinds.kind import FrictionKind
from bowdenfit.kinds.measurements import Measurements
from bowdenfit.words import listed


def measured_groups(description: Description, measurements: Measurements) -> tuple[str, ...]:
    """Groups in the order in which they come, but first the one that predictions are for where that is stated.

    Raises:
        DescriptionError: Groups are to have coefficients of their own, and a table says nothing of groups, or there is one
            group only; or the one that predictions are for is not there.
    """
    tables = [(kind, kind.groups(table)) for kind, table in each_table(measurements) if isinstance(kind, FrictionKind)]
    names = list(dict.fromkeys(name for _, groups in tables for name in groups))
    without = [kind.name for kind, groups in tables if not groups]
    if description.by_group and without:
        raise DescriptionError(
            f'friction_model has "{BY_GROUP}", but the tables of {listed(without)} say nothing of groups, so nobody knows '
            "whose friction they show; add a column group where the table can have one, or fit them apart."
        )
    if description.by_group and len(names) < 2:
        raise DescriptionError(
            f'friction_model has "{BY_GROUP}", but all readings are of one group ({", ".join(names)}); leave it out, or add '
            "readings of another group."
        )
    if description.group is not None and description.group not in names:
        suggestion = suggest_name(description.group, names)
        raise DescriptionError(f"cable.toml, group: there is no group {description.group!r}{suggestion}")
    return tuple(sorted(names, key=lambda name: name != description.group))
