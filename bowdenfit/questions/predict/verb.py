"""Predicting what a cable does at lengths or wrap angles."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias, cast

from cyclopts import Parameter

from bowdenfit.arguments import (
    FIT,
    LENGTHS,
    PATH,
    RESULTS,
    Length,
    NumberWithUnit,
    Quantity,
    Stroke,
    as_pair,
    number_with_unit,
    numbers_with_units_by_name,
    read_first,
)  # fmt: skip
from bowdenfit.display import csv_text, render_text
from bowdenfit.errors import UsageError
from bowdenfit.questions import predict as room
from bowdenfit.verb import Reply, Verb
from bowdenfit.words import listed

if TYPE_CHECKING:
    from bowdenfit.frames import Frame
    from bowdenfit.questions.predict.gait import Gait
    from bowdenfit.questions.predict.predictions import Predictions
    from bowdenfit.results.record import Record

QuantityName = Literal[
    "efficiency", "output-force", "input-force", "preload", "friction", "slack-load", "position", "stiffness", "dynamic-range",
    "preload-window",
]  # fmt: skip
_NOT_STORED = (  # what is not kept
    "input_force", "output_force", "wrap_angles", "preload", "friction_limit", "spring", "contact", "gait", "gait_column",
    "table",
)  # fmt: skip
AT_LENGTHS = ("efficiency", "output-force", "input-force")  # all others are asked at wrap angles
Force: TypeAlias = Annotated[Quantity | None, Parameter(metavar="FORCE"), number_with_unit("100N")]
Angles: TypeAlias = Annotated[
    Quantity | Sequence[Quantity] | Mapping[str, Quantity],
    Parameter("--wrap-angle", metavar="[NAME=]ANGLE"),
    numbers_with_units_by_name("90deg", "bracket edge=45deg"),
]
_QUANTITY = Parameter(metavar="QUANTITY", show_default="efficiency, or what --input-force and --output-force ask for")


@read_first
def predict(
    fit: Annotated["Record", RESULTS, FIT],
    lengths: Annotated[Length | Iterable[Length] | None, Parameter("LENGTHS"), LENGTHS] = None,
    input_force: Force = None,
    stroke: Stroke = "pull",
    output_force: Force = None,
    *,
    quantity: Annotated[QuantityName | None, _QUANTITY] = None,
    wrap_angles: Angles = (),
    preload: Annotated[Quantity | None, Parameter(metavar="FORCE"), number_with_unit("20N")] = None,
    friction_limit: Annotated[Quantity | None, Parameter(metavar="TORQUE"), number_with_unit("50N*mm")] = None,
    spring: Annotated[Quantity | None, Parameter(metavar="STIFFNESS"), number_with_unit("5N/mm")] = None,
    contact: Annotated[str | None, Parameter(metavar="NAME")] = None,
    gait: Annotated[str | Path | None, Parameter(metavar="FILE"), PATH] = None,
    gait_column: Annotated[str | None, Parameter(metavar="HEADING")] = None,
    table: Annotated["str | Path | Frame | None", Parameter(metavar="FILE"), PATH] = None,
) -> "Predictions":
    """Efficiency, a force, or what stretch and preload do, with intervals; one row a route value or wrap angle.

    Args:
        fit: The fit.
        lengths: Route values, in the unit of the route or with another, such as 455, 455mm or 18 in; the description's choices
            if omitted.
        input_force: Force at the motor side, such as 100N.
        stroke: Direction of sliding.
        output_force: Force that is wanted at the load side, such as 100N: what input force gives it.
        quantity: What to predict.
        wrap_angles: Predict at this wrap angle instead of a length (90deg), or bend a contact by it ("bracket edge=45deg").
        preload: Preload the cable with this instead of its own, such as 20N.
        friction_limit: Free-motion friction allowed, for the preload window: 50N*mm (or 5N without a pulley radius).
        spring: Stiffness of springs in series, one with each rope, for the stiffness: 5N/mm.
        contact: Contact that the wrap angles belong to, such as the one a knee bends: the mean over them is predicted.
        gait: Table with those wrap angles in a column, a row each, such as those of a stride at equal times.
        gait_column: Its heading, where it is not one that means a wrap angle.
        table: Table with a row for each prediction: length, wrap angles of contacts, input_force or output_force, stroke.

    Raises:
        UsageError: There is nothing to predict at, no posterior, or the cable has not what is asked for.
    """
    from bowdenfit.questions.error_budget import with_bench_errors  # here, as a kept answer needs no JAX

    fit = with_bench_errors(fit)
    applied_force, wanted_force = as_pair(input_force), as_pair(output_force)
    pairs = cast("list[tuple[str, NumberWithUnit]]", wrap_angles)
    if table is not None:
        _refuse_beside_table(lengths, pairs, quantity, preload, spring, friction_limit, contact, gait, gait_column)
        return room.Predictions(room.predict_table(fit, table, applied_force, wanted_force, stroke))
    angles, named = [angle for name, angle in pairs if not name], [pair for pair in pairs if pair[0]]
    quantity = _choose_quantity(quantity, input_force, output_force)
    over_gait = any(option is not None for option in (contact, gait, gait_column))
    _refuse_nameless_angles(angles, named, over_gait)
    without_route = fit.dataset.description.route is None and fit.model.cable.is_loop
    if not (over_gait or named) and (angles or quantity not in AT_LENGTHS or without_route):
        _refuse_lengths(lengths)
        limit, stiffness = as_pair(friction_limit), as_pair(spring)
        query = room.make_query(fit, angles, applied_force, wanted_force, as_pair(preload), limit, stroke, stiffness)
        return room.Predictions(room.predict_at_wrap_angles(fit, quantity, query))
    _refuse_bend_options(quantity, over_gait or bool(named), preload or spring, friction_limit, input_force)
    gait_angles = room.make_gait(fit, contact, angles, gait, gait_column) if over_gait else None
    return _predict_along_route(fit, lengths, (applied_force, stroke, wanted_force), gait_angles, named)


def _predict_along_route(
    fit: "Record",
    lengths: object,
    forces: tuple[NumberWithUnit | None, str, NumberWithUnit | None],
    gait: "Gait | None",
    named: Sequence[tuple[str, NumberWithUnit]],
) -> "Predictions":
    """Return predictions at lengths, or over a gait at each of them."""
    route_values = room.choose_route_values(fit, cast("list[float | NumberWithUnit] | None", lengths))
    stated = room.read_stated_angles(fit, named, gait)
    if gait is not None:
        return room.Predictions(room.predict_over_gait(fit, route_values, gait, *forces, stated))
    return room.Predictions(room.predict_at_lengths(fit, route_values, *forces, stated))


_BESIDE_TABLE = (
    "LENGTHS", "--wrap-angle", "--quantity", "--preload", "--spring", "--friction-limit", "--contact", "--gait",
    "--gait-column",
)  # fmt: skip


def _refuse_beside_table(*values: object) -> None:
    """Refuse what a table says row by row, or what is not predicted by rows; values in the order of their names."""
    if named := [name for name, value in zip(_BESIDE_TABLE, values, strict=True) if value not in (None, (), [])]:
        raise UsageError(
            f"--table says in its rows where to predict, and {listed(named)} would change nothing: leave that out, or write it "
            "as a column of the table where it has one (a length, a wrap angle of a contact, a force, a stroke)."
        )


def _refuse_nameless_angles(angles: Sequence[NumberWithUnit], named: Sequence[object], over_gait: bool) -> None:
    """Refuse wrap angles of which some say whose they are and others do not."""
    if angles and named and not over_gait:
        value, unit = angles[0]
        raise UsageError(
            f"--wrap-angle {value:g}{unit} does not say which contact is bent, and others do; write NAME={value:g}{unit}, or "
            "name the contact that goes through several as --contact NAME."
        )


def _refuse_lengths(lengths: object) -> None:
    """Refuse lengths where wrap angles are asked for."""
    if lengths:
        raise UsageError("predict at lengths or at wrap angles, not at both; leave one of them out.")


def _refuse_bend_options(
    quantity: QuantityName,
    of_contacts: bool,
    preload: Quantity | None,
    friction_limit: Quantity | None,
    input_force: Quantity | None,
) -> None:
    """Refuse at lengths what is predicted at wrap angles alone."""
    of_bends = preload is not None or friction_limit is not None
    if of_contacts and (quantity not in AT_LENGTHS or of_bends):
        raise UsageError(
            f"--contact, --gait and --wrap-angle NAME=ANGLE are asked of {', '.join(AT_LENGTHS)}; leave the rest out."
        )
    if of_bends:
        raise UsageError(
            "--preload, --spring and --friction-limit belong to predictions at wrap angles; name some, as --wrap-angle 90deg."
        )
    if quantity == "efficiency" and input_force is not None:
        raise UsageError(
            "--quantity efficiency at lengths is that at the fit's own reference force; leave --input-force out."
        )


def _choose_quantity(named: QuantityName | None, input_force: Quantity | None, output_force: Quantity | None) -> QuantityName:
    """Return what is predicted, where it is not named: what the stated force determines at the other end.

    Raises:
        UsageError: Forces of both ends are stated, or one that the quantity does not follow from.
    """
    if input_force is not None and output_force is not None:
        raise UsageError(
            "--input-force asks for the force at the load side, --output-force for that at the motor; leave one of them out."
        )
    if named == "input-force" and output_force is None:
        raise UsageError("--quantity input-force needs the force that is wanted at the load side, as --output-force 100N.")
    if output_force is not None and named not in (None, "input-force"):
        raise UsageError(f"--output-force asks for the input force that it takes; leave --quantity {named} out.")
    if named is not None:
        return named
    return "output-force" if input_force is not None else "input-force" if output_force is not None else "efficiency"


def _reply(rows: list[dict[str, Any]], _: object = None) -> Reply:
    """Return what the command line prints."""
    return Reply(render_text(room.prediction_blocks(rows)), lambda: rows, csv=lambda: csv_text(rows))


def _reply_from_stored(answers: Mapping[str, Any], options: Mapping[str, Any]) -> Reply | None:
    """Return stored efficiencies while pulling, at lengths that can be bought; None of anything else."""
    stored_rows = {length: row for length, row in answers.get("predict", ()) if None not in row.values()}
    other_options = any(options[name] not in (None, (), []) for name in _NOT_STORED)
    lengths = options["lengths"] or tuple(stored_rows)
    if (
        other_options
        or (options["quantity"], options["stroke"]) not in {(None, "pull"), (AT_LENGTHS[0], "pull")}
        or not lengths
    ):
        return None
    if (rows := [stored_rows[length] for length in lengths if length in stored_rows]) and len(rows) == len(lengths):
        return _reply(rows)
    return None


VERB = Verb(
    predict,
    _reply,
    """Predict efficiency, forces, preload, position or stiffness.

    Efficiency, the output force for an input force, or the input force for a wanted
    output force are predicted at LENGTHS (default: the lengths that can be bought)
    or at wrap angles; what stretch and preload do, at wrap angles.

      efficiency      output over input force
      output-force    force at the load side, of --input-force
      input-force     force at the motor that gives --output-force
      preload         tension at rest, and slack where there is none
      friction        force that moves the unloaded cable
      slack-load      input force at which a loop's return side goes slack
      position        error and lost motion at the load side, by stretch, slack and
                      backlash
      stiffness       seen at the load side, motor locked; with --spring, of springs
                      in series too
      dynamic-range   of a loop: the largest force, --input-force, over that of
                      moving it unloaded
      preload-window  lowest preload without slack over these bends, highest for
                      --friction-limit, and the best

    LENGTHS are in the unit of the route, or have their own: 455, 455mm, 18 in.

    --wrap-angle NAME=ANGLE gives a contact this wrap angle, one for each contact; the
    others keep theirs.

    --table FILE predicts one row for each of many: columns with a length, the wrap angle
    of any contact, input_force or output_force, and stroke; what a row leaves blank
    is as fitted, and any other column is refused.

    --contact NAME with several --wrap-angle, or --gait FILE, gives the mean while
    this contact bends, such as over a stride; with moment arms in that file
    (moment_arm_mm) and --input-force, the torque at the joint too.

    The 90 % interval is that of the cable's mean, bench errors included (q05 to q95
    with --csv and --json); that of any one mounting also holds the scatter from one
    mounting of the cable to the next. A note marks what lies outside the lengths, wrap angles
    and loads measured, and where no force is left (0 N: the rope is
    slack).
    """,
    csv="Print as CSV, with mean, sd and quantiles.",
    warns=True,
    needs_coefficients=True,
    kept=_reply_from_stored,
)
