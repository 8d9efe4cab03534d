"""CSV: a lookup table that says what `predict` says, or draws for simulations that vary the cable."""

from bowdenfit.display import csv_heading
from bowdenfit.questions.export.transmission import DRAW, Transmission
from bowdenfit.questions.export.words import comment
from bowdenfit.questions.predict.verb import predict
from bowdenfit.results.record import Record


def lookup_table(fit: Record, found: Transmission) -> str:
    """Efficiency with its intervals by place, as `predict` has it, and the friction exponent behind it.

    Args:
        fit: The fit.
        found: Its tables.
    """
    at = found.places.at
    if found.places.unit == "rad":
        rows = predict(fit, quantity="efficiency", wrap_angles=[(float(angle), "rad") for angle in at])
    else:
        rows = predict(fit, [float(x) for x in at] if found.places.unit else None, quantity="efficiency")
    heads = [*(name for name in rows[0] if name != "note"), *(f"friction_exponent_{x.name}" for x in found.levels)]
    lines = [",".join(map(csv_heading, heads))]
    for i, row in enumerate(rows):
        cells = [value for name, value in row.items() if name != "note"]
        lines.append(",".join(_cell(value) for value in (*cells, *(x.exponent[0, i] for x in found.levels))))
    return "\n".join([comment(found.sentences, "# "), *lines]) + "\n"


def table_of_draws(found: Transmission) -> str:
    """A row for each draw and place: friction of one cable in one mounting.

    Args:
        found: The tables.
    """
    places = found.places
    place = [] if not places.unit else [f"{places.variable}_{places.unit}"]
    heads = ["draw", *place, "friction_exponent_pull", "friction_exponent_return"]
    heads += ["taut_loss_N"] if found.is_loop else []
    heads += ["load_exponent", "drag_N"] if found.of_load else []
    heads += ["stribeck", f"stribeck_speed_{found.speed_unit}", f"viscous_per_{found.speed_unit}"] if found.of_rate else []
    lines = [",".join(map(csv_heading, heads))]
    for level in (one for one in found.levels if one.name.startswith(DRAW)):
        for i, at in enumerate(places.at):
            cells = [level.name.removeprefix(DRAW), *([float(at)] if place else []), *level.exponent[:, i]]
            cells += [level.taut_loss[i]] if found.is_loop else []
            cells += [level.load_exponent, level.drag] if found.of_load else []
            cells += level.rate if found.of_rate else ()
            lines.append(",".join(_cell(value) for value in cells))
    return "\n".join([comment(found.sentences, "# "), *lines]) + "\n"


def _cell(value: object) -> str:
    """Numbers with all their digits, words in quotes where that must be."""
    if isinstance(value, bool):
        return str(value).lower()
    return repr(float(value)) if isinstance(value, float) else csv_heading(str(value))
