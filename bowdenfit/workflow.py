"""The verbs that the command line and notebooks share: fit, load, check, simulate, plot."""

import platform
import secrets
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bowdenfit.dataset import Dataset, load_dataset, single_table_dataset
from bowdenfit.errors import StoreError, UsageError

if TYPE_CHECKING:
    import numpy as np

    from bowdenfit.inference.ensemble import Chain, Progress
    from bowdenfit.results.figure_data import FigureData
    from bowdenfit.results.fit import Fit, Posterior

VERSIONED = ("bowdenfit", "jax", "optimistix", "emcee", "arviz-stats", "numpy", "scipy")
PRIOR_DRAWS = 4096
_LARGEST_SEED = 2**31 - 1


@dataclass
class Stopwatch:
    """Seconds spent in each stage of a fit."""

    seconds: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time what runs inside."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - start


def read(
    dataset: str | Path | Dataset,
    *,
    settings: Sequence[str] = (),
    geometry: str | None = None,
    undetected: str | None = None,
    wrap_angle: tuple[float, str] | None = None,
) -> Dataset:
    """Read and check a data set, without fitting anything.

    Args:
        dataset: Folder with a cable.toml, the file itself, or one table if `wrap_angle` is given.
        settings: Changes to the description, such as "friction.mu1.fixed=0.1".
        geometry: "continuous" or "published", in place of the description's.
        undetected: How angles too small to detect enter: "censored", "zero" or "dropped".
        wrap_angle: Angle and unit of a table without a description.

    Raises:
        DescriptionError, DatasetError: What is wrong, in a sentence.
    """
    if isinstance(dataset, Dataset):
        return dataset
    changes = list(settings)
    if geometry is not None:
        changes.append(f'geometry="{geometry}"')
    if undetected is not None:
        changes.append(f'tables.angles.undetected="{undetected}"')
    if wrap_angle is not None:
        return single_table_dataset(Path(dataset), wrap_angle, changes)
    return load_dataset(Path(dataset), changes)


def fit(
    dataset: str | Path | Dataset,
    *,
    output: str | Path | None = None,
    mcmc: bool = True,
    seed: int | None = None,
    resume: bool = False,
    force: bool = False,
    figures: bool = True,
    draw_in_background: bool = False,
    remember_compilations: bool = False,
    progress: "Callable[[Progress], None] | None" = None,
    **reading: Any,
) -> "Fit":
    """Fit a data set: least squares, then the posterior, then the design answer.

    Args:
        dataset: See `read`; its keywords are taken too.
        output: Results folder to write; nothing is written if omitted.
        mcmc: Whether to sample the posterior; without it there are no intervals.
        seed: Seed of everything random; drawn and recorded if omitted.
        resume: Go on with an interrupted or unconverged fit in `output`.
        force: Replace a fit in `output`.
        figures: Whether to draw figures into `output`.
        draw_in_background: Whether a second process may be started for the figures; the calling program must then guard
            its start with `if __name__ == "__main__"`.
        remember_compilations: Whether JAX may keep compiled programs in the user's cache folder, so that a second fit of
            the same shape compiles nothing; this is a setting of the whole process.
        progress: Called while sampling.
        reading: Keywords of `read`.

    Raises:
        BowdenfitError: What is wrong, in a sentence; nothing is written then.
    """
    watch, folder = Stopwatch(), Path(output) if output is not None else None
    with watch.stage("read"):
        data = read(dataset, **reading)
        seed = _prepared(folder, data, mcmc, seed, resume, force)
    with _drawing(folder if figures else None, draw_in_background) as draw:
        with watch.stage("import JAX"):
            import jax

            if remember_compilations:
                _remember_compilations()
        with jax.enable_x64(True):
            found = _fit(data, folder, mcmc, seed, resume, progress, watch)
            if folder is not None:
                with watch.stage("write"):
                    _write(found, folder)
                with watch.stage("figures"):
                    draw(found)
    return found


def _fit(
    data: Dataset,
    folder: Path | None,
    mcmc: bool,
    seed: int,
    resume: bool,
    progress: "Callable[[Progress], None] | None",
    watch: Stopwatch,
) -> "Fit":
    with watch.stage("import JAX"):
        from bowdenfit.inference.least_squares import least_squares, make_objective, maximum_posterior
        from bowdenfit.inference.posterior import Posterior as Density
        from bowdenfit.models.build import build_model
        from bowdenfit.results.fit import Fit, Provenance
    with watch.stage("compile least squares"):
        density = Density(build_model(data))
        objective = make_objective(density)
    with watch.stage("least squares"):
        start = maximum_posterior(density, objective)
        squares = least_squares(density, objective, start.z)
    posterior = None
    reasons: tuple[str, ...] = () if squares.converged else (squares.message,)
    if mcmc:
        chain = _sampled(density, start, seed, folder, resume, progress, watch)
        with watch.stage("replicate"):
            posterior = _posterior(density, chain, seed)
        reasons = chain.reasons
    provenance = Provenance(seed, _versions(), watch.seconds, datetime.now(UTC).isoformat(timespec="seconds"))
    return Fit(data, squares, posterior, not reasons, reasons, provenance)


def _sampled(
    density: Any,
    start: Any,
    seed: int,
    folder: Path | None,
    resume: bool,
    progress: "Callable[[Progress], None] | None",
    watch: Stopwatch,
) -> "Chain":

    with watch.stage("import emcee and ArviZ"):
        from bowdenfit.inference.ensemble import sample
    from bowdenfit.predictions.draws import for_each_draw
    from bowdenfit.predictions.optimal_length import optimum_of
    from bowdenfit.results.fit import OPTIMAL_EFFICIENCY, OPTIMAL_LENGTH
    from bowdenfit.results.store import CHAIN

    model, settings = density.model, density.model.description.sampler
    with watch.stage("compile the posterior"):
        log_density = density.batched_log_density(settings.n_ensembles * settings.n_walkers // 2)
        optimum = for_each_draw(optimum_of(model), model.space.size) if model.description.route else None

    def quantities(z: "np.ndarray") -> Mapping[str, "np.ndarray"]:
        if optimum is None:
            return {}
        return dict(zip((OPTIMAL_LENGTH, OPTIMAL_EFFICIENCY), optimum(z), strict=True))

    checkpoint = folder / CHAIN if folder is not None else None
    with watch.stage("sample"):
        return sample(density, log_density, start, settings, seed, quantities, checkpoint, resume, progress)


def _posterior(density: Any, chain: "Chain", seed: int) -> "Posterior":
    import numpy as np

    from bowdenfit.predictions.draws import replicate
    from bowdenfit.results.fit import Posterior

    space, shape = density.model.space, chain.z.shape[:2]
    prior_z = np.random.default_rng([seed, 2]).standard_normal((PRIOR_DRAWS, space.size))
    drawn = chain.z.reshape(-1, space.size)
    implied = replicate(density, np.concatenate([drawn, prior_z]), seed)

    def of_posterior(group: str) -> dict[str, np.ndarray]:
        return {name: v[: len(drawn)].reshape(*shape, *v.shape[1:]) for name, v in implied[group].items()}

    prior = {p.name: implied["values"][p.name][len(drawn) :][None] for p in space.free}
    return Posterior(
        chain.z,
        of_posterior("values"),
        chain.quantities,
        of_posterior("log_likelihood"),
        of_posterior("expected"),
        of_posterior("replicated"),
        prior,
        chain.diagnostics,
        chain.n_ensembles,
        chain.steps,
        chain.acceptance,
    )


def _fingerprint(data: Dataset, seed: int) -> dict[str, Any]:
    """What must not change between an interrupted fit and its continuation; how long to sample may."""
    description = data.description.to_json()
    free = {"max_steps", "target_r_hat", "target_ess"}
    description["sampler"] = {k: v for k, v in description["sampler"].items() if k not in free}
    return {"description": description, "sha256": data.sha256, "seed": seed}


def _prepared(folder: Path | None, data: Dataset, mcmc: bool, seed: int | None, resume: bool, force: bool) -> int:
    """Check the output folder, start or check the checkpoint, and return the seed."""
    if resume and (folder is None or not mcmc):
        raise UsageError("--resume needs the results folder of a fit with MCMC; name it with --output.")
    from bowdenfit.results.store import CHAIN, clear, read_checkpoint, refuse_to_overwrite, start_checkpoint

    if resume and folder is not None:
        before = read_checkpoint(folder)
        now = _fingerprint(data, before["seed"] if seed is None else seed)
        changed = [key for key in now if now[key] != before[key]]
        if changed:
            what = {"description": "the description", "sha256": "an input file", "seed": "the seed"}[changed[-1]]
            raise StoreError(
                f"{folder} cannot be resumed because {what} changed since; undo the change, or start over with --force."
            )
        return int(before["seed"])
    seed = secrets.randbelow(_LARGEST_SEED) if seed is None else seed
    if folder is not None:
        if force:
            clear(folder)
        refuse_to_overwrite(folder)
        if mcmc:
            start_checkpoint(folder / CHAIN, _fingerprint(data, seed))
    return seed


def _write(found: "Fit", folder: Path) -> None:
    from bowdenfit.report.text import summary_text
    from bowdenfit.results.store import save, write_text

    save(found, folder, force=True)
    write_text(folder / "summary.txt", summary_text(found))


@contextmanager
def _drawing(folder: Path | None, in_background: bool) -> "Iterator[Callable[[Fit], None]]":
    """A function that draws the figures of a fit into a folder.

    In the background a second process loads matplotlib while this one computes. Only a program that guards its start
    may ask for that (a started process imports the main module again), so the command line does and the library not.
    """
    if folder is None:
        yield lambda _: None
        return
    from bowdenfit.plots.gallery import draw_all

    if not in_background:
        yield lambda found: draw_all(_figure_data(found), folder / "figures")
        return
    with ProcessPoolExecutor(1, get_context("spawn"), initializer=_ready_to_draw) as pool:
        pool.submit(len, ())  # starts the process
        yield lambda found: pool.submit(draw_all, _figure_data(found), folder / "figures").result()


def _ready_to_draw() -> None:
    """Load what drawing needs; an interrupt is the parent's to handle."""
    import signal

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    import bowdenfit.plots.gallery  # noqa: F401


def plot(found: "Fit", folder: str | Path) -> list[Path]:
    """Draw all figures of a fit into a folder, PNG and SVG.

    Args:
        found: The fit.
        folder: Where to; made if missing.

    Returns:
        The files written.
    """
    from bowdenfit.plots.gallery import draw_all

    return draw_all(_figure_data(found), Path(folder))


def _figure_data(found: "Fit") -> "FigureData":
    from bowdenfit.results.figure_data import figure_data

    return figure_data(found)


def load(path: str | Path) -> "Fit":
    """A fit from its results folder, bit for bit as it was saved.

    Raises:
        StoreError: The folder is missing, unfinished or damaged.
    """
    from bowdenfit.results.store import load as load_fit

    return load_fit(Path(path))


def _remember_compilations() -> None:
    """Keep compiled programs in the user's cache folder."""
    import jax
    from platformdirs import user_cache_dir

    jax.config.update("jax_compilation_cache_dir", user_cache_dir("bowdenfit"))
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.1)
    jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)


def predict(
    found: "Fit",
    lengths: Sequence[float] | None = None,
    input_force: tuple[float, str] | None = None,
    stroke: str = "pull",
) -> list[dict[str, Any]]:
    """Efficiency, or output force, at route values, with intervals; one row a value.

    Args:
        found: The fit.
        lengths: Route values; the description's choices if omitted.
        input_force: Force at the motor side and its unit; efficiencies are predicted if omitted.
        stroke: "pull" or "return".

    Raises:
        UsageError: There is nothing to predict at, or no posterior.
    """
    import numpy as np

    from bowdenfit.results.predictions import predicted_rows

    route = found.dataset.description.route
    if lengths is None and route is not None and not route.choices:
        raise UsageError("the description has no choices; name the lengths to predict at.")
    wanted = np.asarray(lengths if lengths is not None else route.choices if route else [0.0], dtype=float)
    return predicted_rows(found, wanted, input_force, stroke)


def simulate(
    bench: str | Path, *, output: str | Path | None = None, seed: int | None = None, noise: bool = True
) -> Dataset:
    """Make a data set from known truth.

    Args:
        bench: A cable.toml with [truth] and [design].
        output: Folder to write the tables, the truth and the seed to; nothing is written if omitted.
        seed: Seed; drawn and recorded if omitted.
        noise: Whether readings scatter.

    Raises:
        BowdenfitError: What is wrong, in a sentence.
    """
    import jax

    from bowdenfit.results.synthetic import make, read_bench, write

    seed = secrets.randbelow(_LARGEST_SEED) if seed is None else seed
    plan = read_bench(Path(bench))
    if output is not None and Path(output).exists() and any(p.name != Path(bench).name for p in Path(output).iterdir()):
        raise StoreError(f"{output} exists already; name another folder with --output, nothing was written.")
    with jax.enable_x64(True):
        dataset, truth = make(plan, jax.random.key(seed), noise)
    if output is not None:
        write(plan, dataset, truth, Path(output), seed)
    return dataset


def _versions() -> dict[str, str]:
    from importlib.metadata import PackageNotFoundError, version

    def of(package: str) -> str:
        try:
            return version(package)
        except PackageNotFoundError:
            return "(not installed)"

    return {package: of(package) for package in VERSIONED} | {"python": platform.python_version()}
