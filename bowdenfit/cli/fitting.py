"""The verb that fits."""

from pathlib import Path
from typing import Any

import click

from bowdenfit.cli.options import name_of, reading, reading_options
from bowdenfit.cli.progress import watched_fit
from bowdenfit.cli.results import show

NOT_TRUSTED = 3


@click.command(short_help="Fit a data set: coefficients, uncertainty, design answer, figures.")
@click.argument("dataset", type=click.Path(path_type=Path))
@reading_options
@click.option(
    "--output", "-o", type=click.Path(path_type=Path), help="Results folder.  [default: fits/NAME OF DATASET]"
)
@click.option("--mcmc/--no-mcmc", default=True, help="Sample the posterior; without it there are no intervals.")
@click.option(
    "--sampler",
    type=click.Choice(["emcee", "nuts", "both"]),
    help="What samples: ensembles of walkers, NUTS for many parameters or narrow posteriors, or both, to have one check the "
    "other.  [default: as in cable.toml, else emcee]",
)
@click.option("--figures/--no-figures", default=True, help="Draw the figures.")
@click.option(
    "--seed", type=click.IntRange(0, 2**31 - 1), help="Seed of everything random.  [default: drawn, and recorded]"
)
@click.option("--resume", is_flag=True, help="Go on with an interrupted or unconverged fit; refuses changed inputs.")
@click.option("--force", is_flag=True, help="Replace an earlier fit in the results folder.")
@click.option("--json", "as_json", is_flag=True, help="Print summary.json instead of the summary for people.")
def fit(
    dataset: Path,
    output: Path | None,
    mcmc: bool,
    sampler: str | None,
    figures: bool,
    seed: int | None,
    resume: bool,
    force: bool,
    as_json: bool,
    **options: Any,
) -> int:
    """Fit DATASET: least squares, posterior, design answer, figures, all written to a results folder.

    DATASET is a folder with cable.toml and tables, or one table or recording with --wrap-angle.
    """
    from bowdenfit import verbs

    folder = output or Path("fits") / name_of(dataset)
    with watched_fit(folder) as progress:
        found = verbs.fit(
            dataset,
            output=folder,
            mcmc=mcmc,
            sampler=sampler,
            seed=seed,
            resume=resume,
            force=force,
            figures=figures,
            in_background=True,
            progress=progress,
            remember_compilations=True,
            **reading(**options),
        )
    show(found, as_json)
    click.echo(f"Wrote {folder}.", err=True)
    return 0 if found.verdict().trusted else NOT_TRUSTED
