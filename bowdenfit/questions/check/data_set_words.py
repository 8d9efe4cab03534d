"""What `bowdenfit check` says: what was understood, and what the measurements will not be able to tell."""

import numpy as np

from bowdenfit.dataset import Dataset
from bowdenfit.description import Contact, Description, FrictionSetting
from bowdenfit.kinds.tables import AngleTable, EfficiencyTable, ForceTable
from bowdenfit.questions.check.elastic_words import elastic_tables, elastic_warnings
from bowdenfit.questions.recorded.words import recordings_text


def check_text(dataset: Dataset) -> str:
    """What was understood of a data set."""
    description, measurements = dataset.description, dataset.measurements
    lines = [description.name, "=" * len(description.name)]
    if description.route:
        route = description.route
        choices = f"; {len(route.choices)} lengths can be bought" if route.choices else ""
        lines.append(f"Route: {route.variable}, {route.range[0]:g} to {route.range[1]:g} {route.unit}{choices}.")
    else:
        lines.append("Route: none, so there is no length to choose.")
    lines += ["", "Contacts:"]
    lines += [f"  {c.name}: {c.friction}, {_angle_source(c, description)}" for c in description.contact]
    lines += ["", "Friction coefficients:"]
    lines += [f"  {name}: {_setting(description.friction.get(name))}" for name in description.coefficients]
    lines += ["", "Measurements:"]
    if measurements.angles is not None:
        lines += _angles(measurements.angles, description)
    if measurements.efficiencies is not None:
        lines.append(_efficiencies(measurements.efficiencies))
    if measurements.forces is not None:
        lines.append(_forces(measurements.forces))
    lines += elastic_tables(description, measurements)
    if measurements.recordings is not None:
        lines += ["", "Recordings:", *(f"  {line}" for line in recordings_text(measurements.recordings))]
    lines += [f"  note: {remark}" for remark in measurements.remarks]
    lines += ["", *(f"Warning: {warning}" for warning in warnings_of(dataset))]
    lines.append("Everything could be read." + (" Nothing is wrong." if not warnings_of(dataset) else ""))
    return "\n".join(lines) + "\n"


def warnings_of(dataset: Dataset) -> list[str]:
    """What the measurements will not be able to tell, as far as counting shows."""
    description, measurements = dataset.description, dataset.measurements
    warnings = []
    free = [
        n
        for n in description.coefficients
        if not (n in description.friction and description.friction[n].fixed is not None)
    ]
    conditions = _conditions(dataset)
    shared = description.stretch.friction is not None and measurements.stretch is not None
    if not conditions and not shared:
        warnings.append(
            "no table has forces, efficiencies, a loop or recordings, so the friction coefficients rest on their priors alone."
        )
    elif 0 < conditions < len(free):
        warnings.append(
            f"{len(free)} friction coefficients are to be found from {conditions} different "
            f"condition{'s' if conditions > 1 else ''}; what these do not determine will rest on the priors."
        )
    if measurements.angles is not None and description.route is not None:
        low, high = description.route.range
        inside = (measurements.angles.route >= low) & (measurements.angles.route <= high)
        for contact in description.curved:
            n = int(np.isfinite(measurements.angles.column(contact.wrap_angle.column or "")[0][inside]).sum())
            if n < 3:
                warnings.append(
                    f"the curve of {contact.name!r} has three coefficients and {n} detected angles in the range; "
                    "its shape will rest on the priors."
                )
    return warnings + elastic_warnings(description, measurements)


def _conditions(dataset: Dataset) -> int:
    """Number of different wrap-angle conditions under which force was measured."""
    rows = []
    tables = dataset.measurements
    for table in (tables.efficiencies, tables.forces, tables.loop):
        if table is not None:
            rows += [tuple(np.nan_to_num(row, nan=-1.0)) for row in np.column_stack([table.route, table.own.angle])]
    if dataset.measurements.recordings is not None:
        rows += [tuple(np.nan_to_num([r.route, *r.own_angle], nan=-1.0)) for r in dataset.measurements.recordings.each]
    return len(set(rows))


def _angle_source(contact: Contact, description: Description) -> str:
    source = contact.wrap_angle
    if source.constant is not None:
        sd = f" +- {source.sd:g}" if source.sd else ""
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


def _setting(setting: FrictionSetting | None) -> str:
    if setting is None:
        return "free, default prior"
    if setting.fixed is not None:
        return f"fixed at {setting.fixed:g}"
    if setting.measured is not None:
        return f"measured separately, {setting.measured.value:g} +- {setting.measured.sd:g}"
    return f"free, prior {setting.prior.model_dump(exclude_none=True)}" if setting.prior else "free"


def _angles(table: AngleTable, description: Description) -> list[str]:
    settings = description.tables.angles
    how = settings.undetected if settings else "censored"
    lines = []
    for name in table.names:
        angle, limit = table.column(name)
        found = np.rad2deg(angle[np.isfinite(angle)])
        below = (
            f", {np.isnan(angle).sum()} below {np.rad2deg(np.nanmax(limit)):g} deg ({how})"
            if np.isnan(angle).any()
            else ""
        )
        spread = f", {found.min():.4g} to {found.max():.4g} deg" if len(found) else ""
        lines.append(f"  {table.origin.files[0]}: {name}, {len(found)} detected{spread}{below}")
    if description.route:
        outside = (table.route < description.route.range[0]) | (table.route > description.route.range[1])
        if outside.any():
            rows = "1 row lies" if outside.sum() == 1 else f"{outside.sum()} rows lie"
            lines.append(f"  {rows} outside the range of the curves, and serves measurements made there.")
    return lines


def _efficiencies(table: EfficiencyTable) -> str:
    low, high = table.efficiency.min(), table.efficiency.max()
    return f"  {table.origin.files[0]}: {len(table.efficiency)} efficiencies, {low:.1%} to {high:.1%}"


def _forces(table: ForceTable) -> str:
    files = table.origin.files[0] if len(table.origin.files) == 1 else f"{len(table.origin.files)} files"
    counts = ", ".join(
        f"{(table.stroke == stroke).sum()} {name}"
        for stroke, name in ((1, "pulling"), (-1, "returning"), (0, "held"))
        if (table.stroke == stroke).any()
    )
    low, high = table.input_force.min(), table.input_force.max()
    readings = f"{len(table.run)} force readings in {len(table.run_names)} runs"
    return f"  {files}: {readings} ({counts}), input {low:.4g} to {high:.4g} N"
