"""Options and arguments that several verbs share."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from bowdenfit.errors import UsageError

Verb = Callable[..., Any]


def reading_options(verb: Verb) -> Verb:
    """Options of the verbs that read a data set."""
    for option in (
        click.option(
            "--wrap-angle", metavar="ANGLE", help="Wrap angle of a single table without cable.toml, such as 180deg."
        ),
        click.option(
            "--undetected",
            type=click.Choice(["censored", "zero", "dropped"]),
            help="How angles too small to detect enter.  [default: as in cable.toml, else censored]",
        ),
        click.option(
            "--geometry",
            type=click.Choice(["continuous", "published"]),
            help="How wrap angles follow the length: one curve over the whole range, or regions with dropped angles as "
            "the on-body paper has them.  [default: as in cable.toml, else continuous]",
        ),
        click.option(
            "--friction",
            metavar="MODEL",
            help="How friction depends on load and speed: capstan, or drag, load-dependent and rate-dependent joined by +.  "
            "[default: as in cable.toml, else capstan]",
        ),
        click.option(
            "--noise",
            type=click.Choice(["normal", "student"]),
            help="How readings scatter: normally, or as a Student-t, with which a few bad readings or mountings hardly pull "
            "the fit.  [default: as in cable.toml, else normal]",
        ),
        click.option(
            "--channel",
            "channels",
            multiple=True,
            metavar="QUANTITY=CHANNEL:UNIT",
            help="Which channel of a recording is input_force, output_force, velocity or time, such as input_force=ai0:lbf "
            "or time=1000Hz; may be repeated.",
        ),
        click.option(
            "--set",
            "settings",
            multiple=True,
            metavar="KEY=VALUE",
            help="Change a setting of cable.toml, such as friction.mu1.fixed=0.1; may be repeated.",
        ),
    ):
        verb = option(verb)
    return verb


def reading(wrap_angle: str | None, **options: Any) -> dict[str, Any]:
    """The options of `reading_options` as the verbs take them."""
    return {**options, "wrap_angle": parsed_quantity(wrap_angle, "--wrap-angle", "180deg") if wrap_angle else None}


def name_of(dataset: Path) -> str:
    """What the results of a data set are called if nothing else is said."""
    return dataset.stem if dataset.suffix else dataset.resolve().name


def parsed_quantity(text: str, option: str, example: str) -> tuple[float, str]:
    """A number with its unit, such as 180deg or "100 N"."""
    digits = len(text) - len(text.lstrip("+-.0123456789"))
    try:
        value, unit = float(text[:digits]), text[digits:].strip()
    except ValueError:
        value, unit = 0.0, ""
    if not unit:
        raise UsageError(f"{option} {text!r} is not a number with its unit; write it as {example}.")
    return value, unit
