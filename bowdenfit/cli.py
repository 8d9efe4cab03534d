"""The command line: arguments in, exit code out."""

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from bowdenfit.errors import BowdenfitError, UsageError

if TYPE_CHECKING:
    from bowdenfit.inference.ensemble import Progress
    from bowdenfit.results.fit import Fit

NOT_TRUSTED, INTERRUPTED = 3, 130
TEMPLATES = ("cable.toml", "angles.csv", "forces.csv")

Verb = Callable[..., Any]


def main() -> None:
    """Run the command line; every error the user can cause is a sentence and an exit code."""
    try:
        sys.exit(bowdenfit.main(standalone_mode=False) or 0)
    except click.exceptions.Exit as stop:
        sys.exit(stop.exit_code)
    except click.ClickException as error:
        error.show()
        sys.exit(error.exit_code)
    except BowdenfitError as error:
        click.echo(f"Error: {error}", err=True)
        sys.exit(error.exit_code)
    except (click.Abort, KeyboardInterrupt):
        click.echo("Interrupted.", err=True)
        sys.exit(INTERRUPTED)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
    except Exception as error:
        if os.environ.get("BOWDENFIT_DEBUG"):
            raise
        click.echo(
            f"Error: something went wrong inside bowdenfit ({type(error).__name__}: {error}). This is our fault: please "
            "report it with what BOWDENFIT_DEBUG=1 prints when you run the command again.",
            err=True,
        )
        sys.exit(1)


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110})
@click.version_option(package_name="bowdenfit", prog_name="bowdenfit")
def bowdenfit() -> None:
    """Friction coefficients of a Bowden cable from bench measurements, with honest uncertainty, and the cable length that
    transmits force best.

    Start with `bowdenfit init FOLDER`, fill in the files, `bowdenfit check FOLDER`, then `bowdenfit fit FOLDER`.

    Exit codes: 0 done (a fit has converged); 1 failure; 2 bad usage or bad input; 3 the fit finished but must not be
    trusted; 130 interrupted, with the checkpoint kept.
    """


def _reading_options(verb: Verb) -> Verb:
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


def _reading(wrap_angle: str | None, **options: Any) -> dict[str, Any]:
    return {**options, "wrap_angle": _quantity(wrap_angle, "--wrap-angle", "180deg") if wrap_angle else None}


def _quantity(text: str, option: str, example: str) -> tuple[float, str]:
    """A number with its unit, such as 180deg or "100 N"."""
    digits = len(text) - len(text.lstrip("+-.0123456789"))
    try:
        value, unit = float(text[:digits]), text[digits:].strip()
    except ValueError:
        value, unit = 0.0, ""
    if not unit:
        raise UsageError(f"{option} {text!r} is not a number with its unit; write it as {example}.")
    return value, unit


@bowdenfit.command(short_help="Write a template to fill in.")
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


@bowdenfit.command(short_help="Say what was understood of a data set and what is wrong.")
@click.argument("dataset", type=click.Path(path_type=Path))
@_reading_options
def check(dataset: Path, **options: Any) -> None:
    """Read everything in DATASET, say what was understood and what is wrong; fit nothing.

    DATASET is a folder with cable.toml and tables, or one table or recording with --wrap-angle. Of a file alone, its
    channels are listed: name, unit, sampling rate, length and range, and what it is as a recording.
    """
    from bowdenfit import workflow
    from bowdenfit.report.check import check_text

    if dataset.is_file() and dataset.suffix.lower() != ".toml" and not options["wrap_angle"]:
        from bowdenfit.report.channels import channels_text

        click.echo(channels_text(*workflow.channels_of(dataset, options["channels"])), nl=False)
        return

    click.echo(check_text(workflow.check(dataset, **_reading(**options))), nl=False)


@bowdenfit.command(short_help="Fit a data set: coefficients, uncertainty, design answer, figures.")
@click.argument("dataset", type=click.Path(path_type=Path))
@_reading_options
@click.option(
    "--output", "-o", type=click.Path(path_type=Path), help="Results folder.  [default: fits/NAME OF DATASET]"
)
@click.option("--mcmc/--no-mcmc", default=True, help="Sample the posterior; without it there are no intervals.")
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
    from bowdenfit import workflow

    folder = output or Path("fits") / (dataset.stem if dataset.suffix else dataset.resolve().name)
    with _interruptible(folder), _progress_bar() as progress:
        found = workflow.fit(
            dataset,
            output=folder,
            mcmc=mcmc,
            seed=seed,
            resume=resume,
            force=force,
            figures=figures,
            in_background=True,
            progress=progress,
            remember_compilations=True,
            **_reading(**options),
        )
    _show(found, as_json)
    click.echo(f"Wrote {folder}.", err=True)
    return 0 if found.converged else NOT_TRUSTED


@contextmanager
def _interruptible(folder: Path) -> Iterator[None]:
    """Say where the checkpoint is when the user (or the system) stops a fit."""
    import signal

    from bowdenfit.results.folder import CHAIN

    signal.signal(signal.SIGTERM, lambda *_: signal.raise_signal(signal.SIGINT))
    try:
        yield
    except KeyboardInterrupt:
        if (folder / CHAIN).exists():
            click.echo(
                f"\nInterrupted; the checkpoint is kept in {folder}: run the same command with --resume.", err=True
            )
            raise click.exceptions.Exit(INTERRUPTED) from None
        raise


@contextmanager
def _progress_bar() -> "Iterator[Callable[[Progress], None] | None]":
    """A bar with R-hat and effective sample size, on a terminal only."""
    if not sys.stderr.isatty():
        yield None
        return
    from tqdm import tqdm

    with tqdm(unit="step", desc="sampling", leave=False, bar_format="{desc} {n_fmt} steps, {elapsed}{postfix}") as bar:

        def report(progress: "Progress") -> None:
            bar.n = progress.steps
            if progress.r_hat is not None and progress.ess is not None:
                bar.set_postfix_str(f"R-hat {progress.r_hat:.3f}, effective draws {progress.ess:.0f}", refresh=False)
            bar.refresh()

        yield report


def _show(found: "Fit", as_json: bool) -> None:
    if as_json:
        import json

        click.echo(json.dumps(found.summary(), indent=1))
    else:
        from bowdenfit.report.text import summary_text

        click.echo(summary_text(found), nl=False)


@bowdenfit.command(short_help="Print the summary of a fit.")
@click.argument("results", type=click.Path(path_type=Path))
@click.option("--json", "as_json", is_flag=True, help="Print summary.json instead of the summary for people.")
def summary(results: Path, as_json: bool) -> None:
    """Print the summary of a finished fit."""
    name = "summary.json" if as_json else "summary.txt"
    if (results / "fit.json").exists() and (results / name).exists():
        click.echo((results / name).read_text(encoding="utf-8"), nl=False)
    else:
        _show(_load(results), as_json)


@bowdenfit.command(short_help="Predict efficiency or output force at lengths.")
@click.argument("results", type=click.Path(path_type=Path))
@click.argument("lengths", type=float, nargs=-1)
@click.option("--input-force", metavar="FORCE", help="Predict the output force for this input force, such as 100N.")
@click.option(
    "--stroke", type=click.Choice(["pull", "return"]), default="pull", show_default=True, help="Direction of sliding."
)
@click.option("--format", "form", type=click.Choice(["csv", "json"]), default="csv", show_default=True)
def predict(results: Path, lengths: tuple[float, ...], input_force: str | None, stroke: str, form: str) -> None:
    """Predict the efficiency, or the output force for an input force, at LENGTHS (default: the lengths that can be bought).

    The interval q05 to q95 is that of the cable's mean; mounting_q05 to mounting_q95 also holds the scatter from one
    mounting of the cable to the next. Lengths outside the range of the curves are marked.
    """
    from bowdenfit.workflow import predict as predicted

    force = _quantity(input_force, "--input-force", "100N") if input_force else None
    rows = predicted(_load(results), lengths or None, force, stroke)
    if form == "json":
        import json

        click.echo(json.dumps(rows, indent=1))
    else:
        click.echo(",".join(rows[0]))
        for row in rows:
            click.echo(",".join(f"{v:.6g}" if isinstance(v, float) else str(v).lower() for v in row.values()))


@bowdenfit.command(short_help="The design answer: which length is best.")
@click.argument("results", type=click.Path(path_type=Path))
@click.option("--json", "as_json", is_flag=True, help="Print as JSON.")
def length(results: Path, as_json: bool) -> None:
    """The design answer: which length is best, how sure that is, and what the lengths that can be bought cost."""
    found = _load(results)
    answer = found.optimal_length()
    if as_json:
        import json

        click.echo(json.dumps(found.summary()["optimal"], indent=1))
    else:
        click.echo(str(answer))
    if not found.converged:
        click.echo("Warning: this fit has not converged; do not use these numbers.", err=True)


@bowdenfit.command(short_help="Compare fits of the same measurements.")
@click.argument("results", type=click.Path(path_type=Path), nargs=-1)
@click.option("--json", "as_json", is_flag=True, help="Print as JSON.")
def compare(results: tuple[Path, ...], as_json: bool) -> None:
    """Compare fits of the same measurements: which model predicts readings left out best, and what changes between them.

    RESULTS are results folders, such as of the same data set fitted with and without --friction rate-dependent; then the
    comparison says whether efficiency depends on speed.
    """
    from bowdenfit import workflow
    from bowdenfit.report.compare import comparison_text

    found = workflow.compare({_short(folder, results): _load(folder) for folder in results})
    if as_json:
        import json

        click.echo(json.dumps(found.page(), indent=1))
    else:
        click.echo(comparison_text(found), nl=False)


def _short(folder: Path, others: tuple[Path, ...]) -> str:
    """A results folder's own name, or its path where two have the same name."""
    return folder.name if [other.name for other in others].count(folder.name) == 1 else str(folder)


@bowdenfit.command(short_help="Draw the figures of a fit again.")
@click.argument("results", type=click.Path(path_type=Path))
@click.option(
    "--output", "-o", type=click.Path(path_type=Path), help="Folder for the figures.  [default: RESULTS/figures]"
)
def plot(results: Path, output: Path | None) -> None:
    """Draw the figures of a finished fit again, as PNG and SVG."""
    from bowdenfit.workflow import plot as draw

    for path in draw(_load(results), output or results / "figures"):
        click.echo(path)


@bowdenfit.command(short_help="Make a data set from known truth.")
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
    from bowdenfit.workflow import simulate as simulated

    simulated(bench, output=output, seed=seed, noise=not no_noise, recordings=recordings)
    click.echo(f"Wrote {output}. Next: bowdenfit fit {output}")


@bowdenfit.command(short_help="Print the shell completion script.")
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
def completion(shell: str) -> None:
    """Print the completion script for SHELL; for bash: eval "$(bowdenfit completion bash)"."""
    from click.shell_completion import get_completion_class

    script = get_completion_class(shell)
    assert script is not None  # the three shells above have one
    click.echo(script(bowdenfit, {}, "bowdenfit", "_BOWDENFIT_COMPLETE").source())


def _load(results: Path) -> "Fit":
    from bowdenfit.workflow import load

    return load(results)


if __name__ == "__main__":
    main()
