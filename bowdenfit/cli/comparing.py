"""The verb that compares fits."""

from pathlib import Path

import click

from bowdenfit.cli.results import load


@click.command(short_help="Compare fits of the same measurements.")
@click.argument("results", type=click.Path(path_type=Path), nargs=-1)
@click.option("--json", "as_json", is_flag=True, help="Print as JSON.")
@click.option(
    "--output",
    "-o",
    type=click.Path(path_type=Path),
    help="Folder for comparison.json, comparison.txt and the figure.  [default: nothing is written]",
)
@click.option("--force", is_flag=True, help="Replace a comparison in --output.")
def compare(results: tuple[Path, ...], as_json: bool, output: Path | None, force: bool) -> None:
    """Compare fits of the same measurements: which model predicts readings left out best, and what changes between them.

    RESULTS are results folders, such as of the same data set fitted with and without --friction rate-dependent; then the
    comparison says whether efficiency depends on speed. Likewise --geometry published against the continuous one, --noise
    student, or --set prior.tau.fixed=0 for a cable whose mountings are all alike.

    Readings that would move the posterior take longer: it is fitted again without them.
    """
    from bowdenfit import verbs
    from bowdenfit.questions.compare.words import comparison_text

    fits = {_short(folder, results): load(folder) for folder in results}
    found = verbs.compare(fits, output=output, force=force, report=lambda line: click.echo(line, err=True))
    if as_json:
        import json

        click.echo(json.dumps(found.page(), indent=1))
    else:
        click.echo(comparison_text(found), nl=False)
    if output is not None:
        click.echo(f"Wrote {output}.", err=True)


def _short(folder: Path, others: tuple[Path, ...]) -> str:
    """A results folder's own name, or its path where two have the same name."""
    return folder.name if [other.name for other in others].count(folder.name) == 1 else str(folder)
