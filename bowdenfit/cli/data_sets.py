"""Verbs before a fit: write a template, check a data set, make one from known truth."""

from importlib import resources
from pathlib import Path
from typing import Any

import click

from bowdenfit.cli.options import reading, reading_options
from bowdenfit.errors import UsageError

TEMPLATES = ("cable.toml", "angles.csv", "forces.csv")


@click.command(short_help="Write a template to fill in.")
@click.argument("folder", type=click.Path(path_type=Path))
def init(folder: Path) -> None:
    """Write a commented template to fill in: cable.toml, angles.csv and forces.csv."""
    there = [name for name in TEMPLATES if (folder / name).exists()]
    if there:
        raise UsageError(f"{folder / there[0]} exists already; name another folder, nothing was written.")
    folder.mkdir(parents=True, exist_ok=True)
    for name in TEMPLATES:
        text = resources.files("bowdenfit.templates").joinpath(name).read_text(encoding="utf-8")
        (folder / name).write_text(text, encoding="utf-8")
    click.echo(f"Wrote {', '.join(TEMPLATES)} to {folder}. Fill them in, then run: bowdenfit check {folder}")


@click.command(short_help="Say what was understood of a data set and what is wrong.")
@click.argument("dataset", type=click.Path(path_type=Path))
@click.option(
    "--prior-predictive",
    "priors",
    type=click.Path(path_type=Path, file_okay=False),
    metavar="FOLDER",
    help="Also draw into FOLDER what the priors alone hold possible beside what was measured, and say which readings lie "
    "outside; a wrong unit shows here before anything is fitted.",
)
@reading_options
def check(dataset: Path, priors: Path | None, **options: Any) -> None:
    """Read everything in DATASET, say what was understood and what is wrong; fit nothing.

    DATASET is a folder with cable.toml and tables, or one table or recording with --wrap-angle. Of a file alone, its
    channels are listed: name, unit, sampling rate, length and range, and what it is as a recording.
    """
    from bowdenfit import verbs
    from bowdenfit.questions.check.data_set_words import check_text

    if dataset.is_file() and dataset.suffix.lower() != ".toml" and not options["wrap_angle"]:
        from bowdenfit.questions.check.channels_words import channels_text

        click.echo(channels_text(*verbs.channels_of(dataset, options["channels"])), nl=False)
        return

    found = verbs.check(dataset, **reading(**options))
    click.echo(check_text(found), nl=False)
    if priors is not None:
        from bowdenfit.questions.check.prior_words import prior_predictive_text
        from bowdenfit.questions.check.verb import show_priors

        click.echo(prior_predictive_text(show_priors(found, priors)) + f"Wrote the figure to {priors}.")


@click.command(short_help="Make a data set from known truth.")
@click.argument("bench", type=click.Path(path_type=Path))
@click.option(
    "--output", "-o", type=click.Path(path_type=Path), required=True, help="Folder for the tables; must not exist."
)
@click.option("--seed", type=click.IntRange(0, 2**31 - 1), help="Seed.  [default: drawn, and recorded]")
@click.option("--no-noise", is_flag=True, help="Readings exactly as the model expects them.")
@click.option(
    "--recordings", is_flag=True, help="Recordings, sample by sample, as a bench gives them; BENCH has [recordings]."
)
def simulate(bench: Path, output: Path, seed: int | None, no_noise: bool, recordings: bool) -> None:
    """Make a data set from known truth.

    BENCH is a cable.toml with two more tables: [truth] with the value of each parameter (what is missing is drawn from its
    prior), and [design] with the lengths and forces to measure at; datasets/synthetic-bench/bench.toml is one. With
    --recordings it has [recordings] in place of [design]: what the motor does, what the bench is like, and what its load
    cells get wrong; datasets/synthetic-recordings/bench.toml is one. The truth and the seed are written beside the tables.
    """
    from bowdenfit.verbs import simulate as simulated

    simulated(bench, output=output, seed=seed, noise=not no_noise, recordings=recordings)
    click.echo(f"Wrote {output}. Next: bowdenfit fit {output}")
