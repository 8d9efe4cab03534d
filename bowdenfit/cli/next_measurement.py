"""The verb that says what to measure next."""

from pathlib import Path

import click

from bowdenfit.cli.results import load
from bowdenfit.errors import UsageError


@click.command("next", short_help="What to measure next.")
@click.argument("results", type=click.Path(path_type=Path))
@click.option(
    "--for",
    "answer",
    metavar="ANSWER",
    help="What is to be known better: optimal-length, optimal-efficiency, efficiency@470, or a parameter such as mu1.  "
    "[default: optimal-length; without a route the friction coefficient]",
)
@click.option(
    "--candidate",
    "candidates",
    multiple=True,
    metavar="KIND@WHERE",
    help="A measurement that you could make, such as angle@450, force@470, efficiency@470, stretch@90deg,50N, preload@90deg or "
    "loop@90deg,30N; may be repeated.  [default: all that the data set's tables can hold]",
)
@click.option(
    "--cost",
    "costs",
    multiple=True,
    metavar="KIND=NUMBER",
    help="What a measurement of a kind costs, in any unit; then candidates are ranked by what they do for their cost; may be "
    "repeated.",
)
@click.option("--top", type=click.IntRange(1), default=10, show_default=True, help="How many candidates to show.")
@click.option("--json", "as_json", is_flag=True, help="Print all candidates as JSON.")
@click.option("--output", "-o", type=click.Path(path_type=Path), help="Folder for the ranking and its figure.")
def next_measurement(
    results: Path,
    answer: str | None,
    candidates: tuple[str, ...],
    costs: tuple[str, ...],
    top: int,
    as_json: bool,
    output: Path | None,
) -> None:
    """What to measure next: candidates ranked by how far each would narrow the answer, on average over what it may read.

    \b
    KIND        a reading of
    angle       the wrap angles of all curved contacts at a length
    force       forces at both ends, a run like those made so far, mounted anew
    efficiency  the efficiency at a length, mounted anew
    stretch     the rope's stretch at a wrap angle and load
    preload     the preload at a wrap angle
    loop        the output force of a pull-pull loop at a wrap angle and input force

    A number without a unit is a value of the route, such as the cable length.
    """  # noqa: D301 - the backspace keeps click from filling the list
    from bowdenfit.questions.next.verb import next_measurement as ranked
    from bowdenfit.questions.next.verb import write

    fit = load(results)
    found = ranked(fit, answer, candidates, dict(_cost(text) for text in costs))
    if output is not None:
        for path in write(found, output, top):
            click.echo(f"Wrote {path}.", err=True)
    if as_json:
        import json

        click.echo(json.dumps(found.page(), indent=1))
    else:
        from bowdenfit.questions.next.words import next_measurement_text

        click.echo(next_measurement_text(found, top), nl=False)
    troubles = fit.verdict().troubles
    if troubles:
        click.echo(f"Warning: this fit is {' and '.join(troubles)}; see bowdenfit summary {results}.", err=True)


def _cost(text: str) -> tuple[str, float]:
    """Kind and cost of an option such as angle=0.5."""
    kind, _, number = text.partition("=")
    try:
        return kind.strip(), float(number)
    except ValueError:
        raise UsageError(f"--cost {text!r} is not a kind and a number; write it as angle=0.5.") from None
