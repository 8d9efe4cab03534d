"""What `bowdenfit check` says: what was understood, and what the measurements cannot determine."""

import numpy as np

from bowdenfit.dataset import Dataset
from bowdenfit.description import Contact, Description, FrictionSetting
from bowdenfit.kinds import iterate_tables
from bowdenfit.kinds.descriptions import order_groups
from bowdenfit.kinds.kind import FrictionKind
from bowdenfit.kinds.tables import Measurements, StretchTable
from bowdenfit.questions.check.copied import describe_copied_readings
from bowdenfit.questions.check.row_words import describe_rows
from bowdenfit.words import counted, filled, kept_narrow, listed


def describe_data_set(dataset: Dataset) -> str:
    """Describe what was understood of a data set."""
    description, measurements = dataset.description, dataset.measurements
    warnings = [filled(f"Warning: {warning}") for warning in warnings_of(dataset)]
    state = f"{counted(len(warnings), 'warning')}, at the end." if warnings else "Nothing is wrong."
    lines = [description.name, "=" * len(description.name), f"Everything could be read. {state}", ""]
    if description.route:
        route = description.route
        choices = f"; {len(route.choices)} lengths can be bought" if route.choices else ""
        line = f"Route: {route.variable}, {route.range[0]:g} to {route.range[1]:g} {route.unit}{choices}."
        lines.append(kept_narrow(line))
    else:
        lines.append("Route: none, so there is no length to choose.")
    lines += ["", "Contacts:"]
    lines += [
        kept_narrow(
            f"{c.name}: {c.friction}, {f'{c.special_law} law, ' if c.special_law else ''}"
            f"{_describe_angle_source(c, description)}",
            "  ",
        )
        for c in description.contact
    ]
    lines += ["", "Friction coefficients:"]
    settings = {name: _describe_setting(description.friction.get(name)) for name in description.coefficients}
    lines += [
        kept_narrow(f"{name}: {setting}{_groups_note(dataset, name)}", "  ") for name, setting in settings.items()
    ]
    lines += ["", "Measurements:"]
    sections: list[str] = []
    for kind, table in iterate_tables(measurements):
        described = [kept_narrow(line, "  ") for line in kind.describe(table, description)]
        if kind.heading:
            sections += ["", f"{kind.heading}:", *described]
        else:
            lines += described
    if description.cable.sharp_bend:
        lines.append(kept_narrow(f"note: {description.cable.sharp_bend}", "  "))
    lines += sections
    lines += [kept_narrow(f"note: {remark}", "  ") for remark in measurements.remarks]
    lines += [
        "",
        "Rows of the files:",
        *(f"  {line}" for words in describe_rows(dataset) for line in words.splitlines()),
    ]
    lines += ["", *warnings] if warnings else []
    return "\n".join(lines) + "\n"


def _groups_note(dataset: Dataset, coefficient: str) -> str:
    """Name the groups that have a coefficient each; empty where all readings share it."""
    contacts = [c for c in dataset.description.contact if c.friction == coefficient]
    if not (dataset.description.by_group and contacts[0].by_group):
        return ""
    return f"; one for each of the groups {listed(order_groups(dataset.description, dataset.measurements))}"


def warnings_of(dataset: Dataset) -> list[str]:
    """Return warnings about what the measurements cannot determine, as far as counting shows."""
    description, measurements = dataset.description, dataset.measurements
    warnings = list(describe_copied_readings(dataset))
    free = [
        n
        for n in description.coefficients
        if not (n in description.friction and description.friction[n].fixed is not None)
    ]
    conditions = _count_conditions(measurements)
    shared = description.stretch.friction is not None and measurements.table(StretchTable) is not None
    if not conditions and not shared:
        warnings.append(
            "no table has forces, efficiencies, a loop or recordings, so the friction coefficients rest on their priors alone."
        )
    elif 0 < conditions < len(free):
        warnings.append(
            f"{len(free)} friction coefficients are to be found from {conditions} different "
            f"condition{'s' if conditions > 1 else ''}; what these do not determine will rest on the priors."
        )
    for kind, table in iterate_tables(measurements):
        warnings += kind.warnings(table, description, measurements)
    if "wrap_angle" in description.preload.model_fields_set and not description.preload_follows_stretch:
        warnings.append(
            "cable.toml gives the wrap angle at which the preload holds, but takes the preload as constant; write "
            'model = "stretch" under [preload] if it changes with the wrap angle.'
        )
    return warnings


def _count_conditions(measurements: Measurements) -> int:
    """Number of different wrap-angle conditions under which force was measured."""
    rows = []
    for kind, table in iterate_tables(measurements):
        if isinstance(kind, FrictionKind):
            conditions = kind.conditions(table)
            rows += [
                tuple(np.nan_to_num(row, nan=-1.0)) for row in np.column_stack([conditions.route, conditions.own.angle])
            ]
    return len(set(rows))


def _describe_angle_source(contact: Contact, description: Description) -> str:
    source = contact.wrap_angle
    if source.constant is not None:
        sd = f" ± {source.sd:g}" if source.sd else ""
        return f"constant wrap angle {source.value:g}{sd} {source.unit}"
    if source.curve:
        where = (
            f", published range {source.published_range[0]:g} to {source.published_range[1]:g}"
            if source.published_range
            else ""
        )
        return f"{source.curve} curve through the column {source.column!r}{where} ({description.geometry} geometry)"
    nominal = f"{source.nominal.value:g} {source.nominal.unit}" if source.nominal else "the rows' mean"
    return f"wrap angle measured in every row, column {source.column!r}; predictions use {nominal}"


def _describe_setting(setting: FrictionSetting | None) -> str:
    if setting is None:
        return "free, default prior"
    if setting.fixed is not None:
        return f"fixed at {setting.fixed:g}"
    if setting.measured is not None:
        return f"measured separately, {setting.measured.value:g} ± {setting.measured.sd:g}"
    return f"free, prior {setting.prior.model_dump(exclude_none=True)}" if setting.prior else "free"
