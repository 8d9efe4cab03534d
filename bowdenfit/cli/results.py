"""Verbs after a fit: summary, predictions, the design answer, figures."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from bowdenfit.cli.options import parsed_quantity

if TYPE_CHECKING:
    from bowdenfit.front_desk import Fit


@click.command(short_help="Print the summary of a fit.")
@click.argument("results", type=click.Path(path_type=Path))
@click.option("--json", "as_json", is_flag=True, help="Print summary.json instead of the summary for people.")
def summary(results: Path, as_json: bool) -> None:
    """Print the summary of a finished fit."""
    name = "summary.json" if as_json else "summary.txt"
    if (results / "fit.json").exists() and (results / name).exists():
        click.echo((results / name).read_text(encoding="utf-8"), nl=False)
    else:
        show(load(results), as_json)


QUANTITIES = (
    "efficiency",
    "output-force",
    "preload",
    "friction",
    "slack-load",
    "position",
    "stiffness",
    "preload-window",
)


@click.command(short_help="Predict efficiency, forces, preload, position or stiffness.")
@click.argument("results", type=click.Path(path_type=Path))
@click.argument("lengths", type=float, nargs=-1)
@click.option(
    "--quantity",
    type=click.Choice(QUANTITIES),
    help="What to predict.  [default: efficiency, or output-force with --input-force]",
)
@click.option(
    "--wrap-angle",
    "wrap_angles",
    multiple=True,
    metavar="ANGLE",
    help="Predict at this wrap angle instead of a length, such as 90deg; may be repeated.",
)
@click.option("--input-force", metavar="FORCE", help="Force at the motor side, such as 100N.")
@click.option("--preload", metavar="FORCE", help="Preload the cable with this instead of its own, such as 20N.")
@click.option(
    "--friction-limit",
    metavar="TORQUE",
    help="What may be felt in free motion, such as 50N*mm (or 5N without a pulley radius), for the preload window.",
)
@click.option(
    "--stroke", type=click.Choice(["pull", "return"]), default="pull", show_default=True, help="Direction of sliding."
)
@click.option("--format", "form", type=click.Choice(["csv", "json"]), default="csv", show_default=True)
def predict(
    results: Path,
    lengths: tuple[float, ...],
    input_force: str | None,
    stroke: str,
    form: str,
    quantity: str | None,
    wrap_angles: tuple[str, ...],
    preload: str | None,
    friction_limit: str | None,
) -> None:
    """Predict the efficiency, or the output force for an input force, at LENGTHS (default: the lengths that can be bought)
    or at wrap angles; or what stretch and preload do at wrap angles.

    \b
    efficiency      output over input force
    output-force    force at the load side
    preload         tension at rest, and slack where there is none
    friction        what moving the unloaded cable takes
    slack-load      input force at which a loop's return side goes slack
    position        error and lost motion at the load side, by stretch, slack and backlash
    stiffness       seen at the load side, motor locked
    preload-window  lowest preload without slack over these bends, highest for --friction-limit, and the best

    The interval q05 to q95 is that of the cable's mean; mounting_q05 to mounting_q95 also holds the scatter from one
    mounting of the cable to the next. Lengths outside the range of the curves are marked.
    """  # noqa: D301 - the backspace keeps click from filling the list
    from bowdenfit.verbs import predict as predicted

    def number(text: str | None, option: str, example: str) -> tuple[float, str] | None:
        return parsed_quantity(text, option, example) if text else None

    rows = predicted(
        load(results),
        lengths or None,
        number(input_force, "--input-force", "100N"),
        stroke,
        quantity=quantity,
        wrap_angles=[parsed_quantity(angle, "--wrap-angle", "90deg") for angle in wrap_angles],
        preload=number(preload, "--preload", "20N"),
        friction_limit=number(friction_limit, "--friction-limit", "50N*mm"),
    )
    if form == "json":
        import json

        click.echo(json.dumps(rows, indent=1))
    else:
        click.echo(",".join(rows[0]))
        for row in rows:
            click.echo(",".join(_cell(value) for value in row.values()))


def _cell(value: object) -> str:
    """A value as CSV."""
    if isinstance(value, float):
        return f"{value:.6g}"
    return f'"{value}"' if isinstance(value, str) else str(value).lower()


@click.command(short_help="The design answer: which length is best.")
@click.argument("results", type=click.Path(path_type=Path))
@click.option("--json", "as_json", is_flag=True, help="Print as JSON.")
def length(results: Path, as_json: bool) -> None:
    """The design answer: which length is best, how sure that is, and what the lengths that can be bought cost."""
    found = load(results)
    answer = found.optimal_length()
    if as_json:
        import json

        click.echo(json.dumps(found.summary()["optimal"], indent=1))
    else:
        click.echo(str(answer))
    troubles = found.verdict().troubles
    if troubles:
        click.echo(f"Warning: this fit is {' and '.join(troubles)}; see bowdenfit summary {results}.", err=True)


@click.command(short_help="Draw the figures of a fit again.")
@click.argument("results", type=click.Path(path_type=Path))
@click.option(
    "--output", "-o", type=click.Path(path_type=Path), help="Folder for the figures.  [default: RESULTS/figures]"
)
def plot(results: Path, output: Path | None) -> None:
    """Draw the figures of a finished fit again, as PNG and SVG."""
    from bowdenfit.verbs import plot as draw

    for path in draw(load(results), output or results / "figures"):
        click.echo(path)


def load(results: Path) -> "Fit":
    """A finished fit."""
    from bowdenfit.verbs import load

    return load(results)


def show(found: "Fit", as_json: bool) -> None:
    """Print the summary, for people or as JSON."""
    if as_json:
        import json

        click.echo(json.dumps(found.summary(), indent=1))
    else:
        from bowdenfit.questions.summary.words import summary_text

        click.echo(summary_text(found), nl=False)
