"""The verb that says what measurements determine."""

from pathlib import Path
from typing import Any

import click

from bowdenfit.cli.options import reading, reading_options


@click.command(short_help="Which coefficients the measurements determine, and which rest on the prior.")
@click.argument("source", type=click.Path(path_type=Path))
@reading_options
@click.option(
    "--output", "-o", type=click.Path(path_type=Path), help="Folder for identifiability.json, .txt and figures."
)
@click.option("--json", "as_json", is_flag=True, help="Print as JSON.")
def identify(source: Path, output: Path | None, as_json: bool, **options: Any) -> None:
    """Say which friction coefficients, or which sums of them, SOURCE determines and how well, and which rest on the prior.

    SOURCE is a plan, before anything is measured (a cable.toml with [design], the lengths and forces that you intend to
    measure at, such as datasets/synthetic-bench/bench.toml); a data set; or the results folder of a fit.
    """
    from bowdenfit.questions.identify.verb import identify as identified
    from bowdenfit.questions.identify.verb import write
    from bowdenfit.questions.identify.words import identifiability_text

    found = identified(source, **reading(**options))
    if output is not None:
        for path in write(found, output):
            click.echo(f"Wrote {path}.", err=True)
    if as_json:
        import json

        click.echo(json.dumps(found.page(), indent=1))
    else:
        click.echo(identifiability_text(found), nl=False)
