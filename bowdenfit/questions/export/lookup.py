"""CSV: a lookup table that says what `predict` says, or draws for simulations that vary the cable."""

from bowdenfit.display import csv_heading
from bowdenfit.questions.export.transmission import DRAW, TransmissionTables
from bowdenfit.questions.export.words import comment
from bowdenfit.questions.predict.verb import predict
from bowdenfit.results.record import Record


def lookup_table(fit: Record, tables: TransmissionTables) -> str:
    """Efficiency with its intervals by place, as `predict` has it, and the friction exponent behind it.

    Args:
        fit: The fit.
        found: Its tables.
    """
    points = tables.points.values
    if tables.points.unit == "rad":
        rows = predict(fit, quantity="efficiency", wrap_angles=[(float(angle), "rad") for angle in points])
    else:
        rows = predict(fit, [float(x) for x in points] if tables.points.unit else None, quantity="efficiency")
    heads = [*(name for name in rows[0] if name != "note"), *(f"friction_exponent_{x.name}" for x in tables.levels)]
    lines = [",".join(map(csv_heading, heads))]
    for i, row in enumerate(rows):
        cells = [value for name, value in row.items() if name != "note"]
        lines.append(",".join(_cell(value) for value in (*cells, *(x.exponent[0, i] for x in tables.levels))))
    return "\n".join([comment(tables.sentences, "# "), *lines]) + "\n"


def draws_table(tables: TransmissionTables) -> str:
    """A row for each draw and place: friction of one cable in one mounting.

    Args:
        found: The tables.
    """
    points = tables.points
    point_heading = [] if not points.unit else [f"{points.variable}_{points.unit}"]
    heads = ["draw", *point_heading, "friction_exponent_pull", "friction_exponent_return"]
    heads += ["taut_loss_N"] if tables.is_loop else []
    heads += ["load_exponent", "drag_N"] if tables.depends_on_load else []
    heads += (
        ["stribeck", f"stribeck_speed_{tables.speed_unit}", f"viscous_per_{tables.speed_unit}"]
        if tables.depends_on_rate
        else []
    )
    lines = [",".join(map(csv_heading, heads))]
    for level in (level for level in tables.levels if level.name.startswith(DRAW)):
        for i, point in enumerate(points.values):
            cells = [level.name.removeprefix(DRAW), *([float(point)] if point_heading else []), *level.exponent[:, i]]
            cells += [level.taut_loss[i]] if tables.is_loop else []
            cells += [level.load_exponent, level.drag] if tables.depends_on_load else []
            cells += level.rate if tables.depends_on_rate else ()
            lines.append(",".join(_cell(value) for value in cells))
    return "\n".join([comment(tables.sentences, "# "), *lines]) + "\n"


def _cell(value: object) -> str:
    """Numbers with all their digits, words in quotes where that must be."""
    if isinstance(value, bool):
        return str(value).lower()
    return repr(float(value)) if isinstance(value, float) else csv_heading(str(value))
