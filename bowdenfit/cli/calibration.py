"""The verb that calibrates."""

from pathlib import Path
from typing import Any

import click

from bowdenfit.cli.options import name_of, reading, reading_options
from bowdenfit.cli.progress import watched_calibration

NOT_CALIBRATED = 3


@click.command(short_help="Show that a description's intervals hold the truth as often as they say.")
@click.argument("dataset", type=click.Path(path_type=Path))
@reading_options
@click.option("--replications", "-n", type=click.IntRange(2), default=200, show_default=True, help="How many.")
@click.option("--workers", "-j", type=click.IntRange(1), help="Processes.  [default: one a core]")
@click.option(
    "--output",
    "-o",
    type=click.Path(path_type=Path),
    help="Results folder.  [default: fits/calibration/NAME OF DATASET]",
)
@click.option(
    "--assume",
    "assumptions",
    multiple=True,
    metavar="KEY=VALUE",
    help="Fit with this setting changed, while simulating without: what a wrong assumption costs; may be repeated.",
)
@click.option(
    "--seed", type=click.IntRange(0, 2**31 - 1), help="Seed of everything random.  [default: drawn, and recorded]"
)
@click.option("--resume", is_flag=True, help="Go on with an interrupted calibration, or add replications.")
@click.option("--force", is_flag=True, help="Replace an earlier calibration in the results folder.")
@click.option("--json", "as_json", is_flag=True, help="Print calibration.json instead of the summary for people.")
def calibrate(
    dataset: Path,
    replications: int,
    workers: int | None,
    output: Path | None,
    assumptions: tuple[str, ...],
    seed: int | None,
    resume: bool,
    force: bool,
    as_json: bool,
    **options: Any,
) -> int:
    """Simulation-based calibration of DATASET: of this very description, for tables like these.

    Again and again, true values are drawn from the priors, tables like the measured ones (the same lengths, runs, loads and
    wrap angles) are simulated with them and fitted. Then intervals must hold the truth as often as they claim, for every
    parameter, the optimal length and the efficiency there. What was measured enters only by the design.

    Takes some seconds a replication and core. Exit code 3: not calibrated.
    """
    from bowdenfit import verbs
    from bowdenfit.questions.calibrate.words import calibration_text

    folder = output or Path("fits/calibration") / name_of(dataset)
    with watched_calibration(folder) as progress:
        found = verbs.calibrate(
            dataset,
            replications=replications,
            workers=workers,
            output=folder,
            assume=assumptions,
            seed=seed,
            resume=resume,
            force=force,
            progress=progress,
            **reading(**options),
        )
    if as_json:
        import json

        click.echo(json.dumps(found.page(), indent=1))
    else:
        click.echo(calibration_text(found), nl=False)
    click.echo(f"Wrote {folder}.", err=True)
    return 0 if found.is_calibrated else NOT_CALIBRATED
