"""`bf.fit` and `bowdenfit fit`."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, Unpack
from warnings import warn

from cyclopts import Parameter

from bowdenfit import run
from bowdenfit.arguments import DATASET, HIDDEN, PATH, Output, Purpose, Seed, numbers_by_name, read_first
from bowdenfit.inference.resources import keep_compiled_programs, refuse_low_memory
from bowdenfit.questions.summary.verb import reply
from bowdenfit.reading import Reading, read
from bowdenfit.results.folder import CHAIN, FIT, remove_checkpoint, reserve_folder
from bowdenfit.stage_bar import Watch, show_progress_bar
from bowdenfit.stages import announce_stage
from bowdenfit.verb import Reply, Verb

if TYPE_CHECKING:
    from bowdenfit.dataset import Dataset
    from bowdenfit.finished_fit import Fit
    from bowdenfit.frames import Frame
    from bowdenfit.inference.chain import Progress

Sampler = Literal["emcee", "nuts", "importance", "both"]


@read_first
def fit(
    dataset: Annotated["str | Path | Dataset | Frame", DATASET, PATH],
    *,
    output: Annotated[Output, Parameter(show_default="fits/NAME OF DATASET")] = None,
    mcmc: Annotated[bool, Parameter(negative="--no-mcmc")] = True,
    sampler: Annotated[Sampler | None, Parameter(show_default="as in cable.toml, else by the model")] = None,
    figures: Annotated[bool, Parameter(negative="--no-figures")] = True,
    seed: Annotated[Seed, Parameter(show_default="random, and recorded")] = None,
    start: Annotated[
        Mapping[str, float] | None, Parameter("--start", metavar="NAME=VALUE"), numbers_by_name("mu1=0.1", "parameter")
    ] = None,
    resume: bool = False,
    force: bool = False,
    purpose: Purpose = "design",
    progress: Annotated["Callable[[Progress], None] | None", HIDDEN] = None,
    report: Annotated[Callable[[str], None], HIDDEN] = warn,
    answered: Annotated["Callable[[Fit], object]", HIDDEN] = lambda _: None,
    **reading: Unpack[Reading],
) -> "Fit":
    """Fit a data set: least squares, then the posterior, then the design answer. Nothing is written unless `output` says where.

    Example: fit = bf.fit(frame, wrap_angle="180deg", settings=["friction.mu.fixed=0.1"], seed=1, output="fits/bench")

    Args:
        dataset: See `bowdenfit.read`; its keywords are taken too.
        output: Results folder.
        mcmc: Sample the posterior; without it, least squares and its intervals only.
        sampler: Ensembles of walkers, NUTS for many parameters or narrow posteriors, or both, one to check the other.
        figures: Draw the figures.
        seed: Random seed.
        start: Value of a parameter, in the unit in which it is shown, at which the search for the best fit begins too, besides
            its usual starts; may be repeated.
        resume: Go on with an interrupted or unconverged fit; refuses changed inputs.
        force: Replace an earlier fit in the results folder.
        purpose: What the command's first line and exit code are about: "design", the best length, or "coefficients".
        progress: Called while sampling; a notebook shows one line with stage, clock and progress if omitted.
        report: Called with a sentence where the fit is whole but its figures could not be drawn; a warning if omitted.
        answered: Called with the fit as soon as it is known and written, before figures are drawn.
        reading: Keywords of `bowdenfit.read`.

    Raises:
        BowdenfitError: What is wrong, in a sentence; nothing is written then.
    """
    del purpose  # of the command alone
    refuse_low_memory()
    folder = Path(output) if output is not None else None
    with show_progress_bar(WATCH, progress) as show:
        data = run.choose_sampler(read(dataset, **reading), sampler, mcmc)
        announce_stage("starting the fit")
        with reserve_folder(folder):
            seed = run.choose_seed(folder, data, mcmc, seed, resume, force)
            keep_compiled_programs()
            if mcmc:
                checkpoint = partial(run.start_checkpointing, folder, data, seed, resume)
                result = run.fit_posterior(data, seed, checkpoint, resume, show, start or {})
            else:
                result = run.fit_classically(data, seed, start or {})
            _write(result, folder, figures, report, answered)
    return result


def _write(
    result: "Fit", folder: Path | None, figures: bool, report: Callable[[str], None], answered: "Callable[[Fit], object]"
) -> None:
    """Write a fit where there is a folder, and hand it on as soon as it is written, before its figures are drawn."""
    for sentence in run.save_results(result, folder) if folder is not None else ():
        report(sentence)
    if folder is not None and result.converged:
        remove_checkpoint(folder)
    answered(result)
    for sentence in run.draw_results(result, folder, figures) if folder is not None else ():
        report(sentence)


def _reply(fit: "Fit", request: dict[str, Any]) -> Reply:
    summary = reply(fit, {"purpose": request["purpose"]})
    return replace(summary, notes=(f"Wrote {request['output']}.",))


def _show(bar: Any, progress: "Progress") -> None:
    """Show steps, R-hat (how much all chains spread beyond one), the effective sample size, and the minutes left if many."""
    bar.n, words = progress.steps, list[str]()
    bar.set_description_str(f"sampling with {progress.sampler}", refresh=False)
    if progress.r_hat is not None and progress.ess is not None:
        words.append(f"R-hat {progress.r_hat:.3f}, {progress.ess:.0f} effective draws")
    if progress.seconds_left is not None and progress.seconds_left > _LONG:
        words.append(f"at least {progress.seconds_left / 60:.0f} min left")
    bar.set_postfix_str(", ".join(words), refresh=False)
    bar.refresh()


_LONG = 60  # seconds of sampling from which the bar says how long it takes
_BAR = {"unit": "step", "desc": "sampling", "bar_format": "{desc} {n_fmt} steps, {elapsed}{postfix}"}
WATCH = Watch(CHAIN, "the checkpoint is kept in", _BAR, _show, FIT)
VERB = Verb(
    fit,
    _reply,
    """Fit a data set: coefficients, uncertainty, best length, figures.

    Least squares, the posterior, the design answer and figures are written to a
    results folder. DATASET is a folder with cable.toml and tables, or one table or
    recording with --wrap-angle.
    """,
    json="Print summary.json instead of the text summary.",
    results="fits",
    watch=WATCH,
)
