"""Fitting a data set."""

from collections.abc import Callable
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, Unpack
from warnings import warn

from bowdenfit.given import with_checked_keywords
from bowdenfit.inference.engines.processes import settings_of_process
from bowdenfit.questions.summary.verb import reply
from bowdenfit.reading import Reading, read, refuse_unknown
from bowdenfit.results.folder import CHAIN
from bowdenfit.verb import A_DATASET, LARGEST_SEED, NOT_TRUSTED, Argument, Option, Output, Reply, Verb, Watch
from bowdenfit.words import percent

if TYPE_CHECKING:
    from bowdenfit.dataset import Dataset
    from bowdenfit.front_desk import Fit
    from bowdenfit.inference.chain import Progress


@with_checked_keywords
def fit(
    dataset: Annotated["str | Path | Dataset", Argument("DATASET", such_as=A_DATASET)],
    *,
    output: Annotated[Output, Option(("-o",), default="fits/NAME OF DATASET")] = None,
    mcmc: Annotated[bool, Option()] = True,
    sampler: Annotated[Literal["emcee", "nuts", "both"] | None, Option(default="as in cable.toml, else emcee")] = None,
    figures: Annotated[bool, Option()] = True,
    seed: Annotated[int | None, Option(least=0, most=LARGEST_SEED, default="drawn, and recorded")] = None,
    resume: Annotated[bool, Option()] = False,
    force: Annotated[bool, Option()] = False,
    in_background: bool = False,
    remember_compilations: bool = False,
    progress: "Callable[[Progress], None] | None" = None,
    report: Callable[[str], None] = warn,
    **reading: Unpack[Reading],
) -> "Fit":
    """Fit a data set: least squares, then the posterior, then the design answer. Nothing is written unless `output` says where.

    Args:
        dataset: See `bowdenfit.read`; its keywords are taken too.
        output: Results folder.
        mcmc: Sample the posterior; without it there are no intervals.
        sampler: Ensembles of walkers, NUTS for many parameters or narrow posteriors, or both, one to check the other.
        figures: Draw the figures.
        seed: Seed of everything random.
        resume: Go on with an interrupted or unconverged fit; refuses changed inputs.
        force: Replace an earlier fit in the results folder.
        in_background: Start other processes, which is quicker; programs then begin with `if __name__ == "__main__"`.
        remember_compilations: Whether JAX may keep compiled programs in the user's cache folder; a setting of the process.
        progress: Called while sampling; a notebook shows a bar if omitted.
        report: Called with a sentence where the fit is whole but its figures could not be drawn; a warning if omitted.
        reading: Keywords of `bowdenfit.read`.

    Raises:
        BowdenfitError: What is wrong, in a sentence; nothing is written then.
    """
    from bowdenfit.notebook import watched
    from bowdenfit.results.folder import reserved
    from bowdenfit.run.helpers import assistant, light_processes
    from bowdenfit.run.storing import choose_seed, start_checkpointing, with_sampler, write_results

    refuse_unknown(fit, reading)
    folder = Path(output) if output is not None else None
    drawing, settings = figures and folder is not None, settings_of_process(remember_compilations)
    with ExitStack() as held:
        light = held.enter_context(light_processes(in_background, drawing, mcmc))
        data = with_sampler(read(dataset, **reading), sampler, mcmc)
        held.enter_context(reserved(folder))
        seed = choose_seed(folder, data, mcmc, seed, resume, force)
        helper = held.enter_context(assistant(light, in_background and (mcmc or drawing), settings, drawing, mcmc))
        show = held.enter_context(watched(WATCH, progress)) if mcmc else None
        import jax

        from bowdenfit.run.fitting import run

        with jax.enable_x64(True):
            found = run(data, partial(start_checkpointing, folder, data, seed, resume), mcmc, seed, resume, show, helper)
            for sentence in write_results(found, folder, figures, helper) if folder is not None else ():
                report(sentence)
    return found


def _reply(found: "Fit", asked: dict[str, Any]) -> Reply:
    said = reply(found, {})
    exit_code = 0 if found.verdict().trusted else NOT_TRUSTED
    return Reply(said.text, said.page, (f"Wrote {asked['output']}.",), exit_code)


def _show(bar: Any, progress: "Progress") -> None:
    """Steps, how much wider all starts spread than one (R-hat), and the effective sample size."""
    bar.n = progress.steps
    bar.set_description_str(f"sampling with {progress.sampler}", refresh=False)
    if progress.r_hat is not None and progress.ess is not None:
        differ = percent(max(progress.r_hat - 1, 0.0))
        bar.set_postfix_str(f"starts differ by {differ}, worth {progress.ess:.0f} samples", refresh=False)
    bar.refresh()


_BAR = {"unit": "step", "desc": "sampling", "bar_format": "{desc} {n_fmt} steps, {elapsed}{postfix}"}
WATCH = Watch(CHAIN, "the checkpoint is kept in", _BAR, _show)
VERB = Verb(
    fit,
    _reply,
    "Fit a data set: coefficients, uncertainty, design answer, figures.",
    """Fit DATASET: least squares, posterior, design answer, figures, all written to a results folder.

    DATASET is a folder with cable.toml and tables, or one table or recording with --wrap-angle.
    """,
    json="Print summary.json instead of the summary for people.",
    results="fits",
    watch=WATCH,
    behind={"in_background": True, "remember_compilations": True},
)
