"""The verbs that the command line and notebooks share: fit, load, check, simulate, plot."""

import secrets
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bowdenfit.dataset import Dataset, load_dataset, single_file_dataset
from bowdenfit.errors import DatasetError, StoreError, UsageError
from bowdenfit.questions.calibrate.verb import calibrate as calibrate
from bowdenfit.recordings.forces import parsed_channels
from bowdenfit.run.helpers import assistants, draw, load_ahead
from bowdenfit.run.storing import LARGEST_SEED, begun, checked_seed, sampled_by, write_results

if TYPE_CHECKING:
    from bowdenfit.files.channels import ChannelFile
    from bowdenfit.front_desk import Fit
    from bowdenfit.inference.chain import Progress
    from bowdenfit.questions.compare.answer import Comparison
    from bowdenfit.recordings.recording import Recordings


def read(
    dataset: str | Path | Dataset,
    *,
    settings: Sequence[str] = (),
    geometry: str | None = None,
    undetected: str | None = None,
    friction: str | None = None,
    noise: str | None = None,
    wrap_angle: tuple[float, str] | None = None,
    channels: Sequence[str] = (),
) -> Dataset:
    """Read and check a data set, without fitting anything.

    Args:
        dataset: Folder with a cable.toml, the file itself, or one table if `wrap_angle` is given.
        settings: Changes to the description, such as "friction.mu1.fixed=0.1".
        geometry: "continuous" or "published", in place of the description's.
        undetected: How angles too small to detect enter: "censored", "zero" or "dropped".
        friction: How friction depends on load and speed: "capstan", or "drag", "load-dependent" and "rate-dependent"
            joined by "+".
        noise: How readings scatter: "normal", or "student" where a few may be grossly wrong.
        wrap_angle: Angle and unit of a table or recording without a description.
        channels: Channels of recordings, such as "input_force=ai0:lbf" or "time=1000Hz".

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
    if friction is not None:
        changes.append(f'friction_model="{friction}"')
    if noise is not None:
        changes.append(f'noise="{noise}"')
    sources = parsed_channels(channels)
    if wrap_angle is not None:
        return single_file_dataset(Path(dataset), wrap_angle, changes, sources)
    return load_dataset(Path(dataset), changes, sources)


def check(dataset: str | Path | Dataset, **reading: Any) -> Dataset:
    """Read a data set, and build the model where only that can tell whether the description makes sense.

    Loading JAX takes longer than everything else here, so the model is built only for names and priors that the
    description alone cannot judge.

    Args:
        dataset: See `read`; its keywords are taken too.
        reading: Keywords of `read`.

    Raises:
        DescriptionError, DatasetError: What is wrong, in a sentence.
    """
    data = read(dataset, **reading)
    description = data.description
    usual = all(c.law == "capstan" and c.wrap_angle.curve in {None, "gaussian"} for c in description.contact)
    if (
        not usual
        or description.friction_model != "capstan"
        or data.measurements.recordings
        or description.prior
        or any(setting.prior for setting in description.friction.values())
    ):
        import jax

        from bowdenfit.model import build_model

        with jax.enable_x64(True):
            build_model(data)
    return data


def channels_of(path: str | Path, channels: Sequence[str] = ()) -> "tuple[ChannelFile, Recordings | None, str]":
    """The channels of a recording's file, and the recording that they make.

    Args:
        path: A file.
        channels: Which channel is what, such as "input_force=ai0:lbf".

    Returns:
        The channels; the recording, prepared and cut into strokes, None where it cannot be; and why not, in a sentence.

    Raises:
        DatasetError: The file cannot be read.
    """
    from bowdenfit.files import read_channels

    file = read_channels(Path(path))
    try:
        data = single_file_dataset(Path(path), (0.0, "deg"), (), parsed_channels(channels), kind="recordings")
    except DatasetError as error:
        return file, None, str(error)
    return file, data.measurements.recordings, ""


def fit(
    dataset: str | Path | Dataset,
    *,
    output: str | Path | None = None,
    mcmc: bool = True,
    sampler: str | None = None,
    seed: int | None = None,
    resume: bool = False,
    force: bool = False,
    figures: bool = True,
    in_background: bool = False,
    remember_compilations: bool = False,
    progress: "Callable[[Progress], None] | None" = None,
    **reading: Any,
) -> "Fit":
    """Fit a data set: least squares, then the posterior, then the design answer.

    Args:
        dataset: See `read`; its keywords are taken too.
        output: Results folder to write; nothing is written if omitted.
        mcmc: Whether to sample the posterior; without it there are no intervals.
        sampler: "emcee", "nuts", or "both" to have one check the other; the description's if omitted.
        seed: Seed of everything random; drawn and recorded if omitted.
        resume: Go on with an interrupted or unconverged fit in `output`.
        force: Replace a fit in `output`.
        figures: Whether to draw figures into `output`.
        in_background: Whether other processes may be started for statistics and figures, which is quicker; the calling
            program must then guard its start with `if __name__ == "__main__"`.
        remember_compilations: Whether JAX may keep compiled programs in the user's cache folder, so that a second fit of
            the same shape compiles nothing; this is a setting of the whole process.
        progress: Called while sampling.
        reading: Keywords of `read`.

    Raises:
        BowdenfitError: What is wrong, in a sentence; nothing is written then.
    """
    folder = Path(output) if output is not None else None
    if in_background and not isinstance(dataset, Dataset):
        load_ahead("jax", "scipy.optimize")  # while recordings are read, which takes seconds
    data = read(dataset, **reading)
    if sampler is not None:
        data = sampled_by(data, sampler)
    seed = checked_seed(folder, data, mcmc, seed, resume, force)
    with assistants(in_background and mcmc, in_background and figures and folder is not None) as helpers:
        import jax

        from bowdenfit.run.fitting import run
        from bowdenfit.run.stopwatch import Stopwatch

        if remember_compilations:
            _remember_compilations()
        with jax.enable_x64(True):
            begin = partial(begun, folder, data, seed, resume)
            found = run(data, begin, mcmc, seed, resume, progress, Stopwatch(), helpers)
            if folder is not None:
                write_results(found, folder, figures, helpers)
    return found


def compare(
    fits: "Mapping[str, Fit]",
    *,
    output: str | Path | None = None,
    force: bool = False,
    report: Callable[[str], None] | None = None,
) -> "Comparison":
    """Compare fits of the same measurements.

    Args:
        fits: By name.
        output: Folder for comparison.json, comparison.txt and the figure; nothing is written if omitted.
        force: Replace a comparison in `output`.
        report: Called with a sentence before each reading that takes longer, because it would move the posterior.

    Raises:
        UsageError: There are fewer than two, one has no posterior, or they are not of the same readings.
        StoreError: `output` holds something already.
    """
    import jax

    from bowdenfit.questions.compare.answer import compare as compared
    from bowdenfit.questions.compare.verb import refuse_to_replace, write_comparison

    if output is not None:
        refuse_to_replace(Path(output), force)
    with jax.enable_x64(True):
        found = compared(fits, report)
    if output is not None:
        write_comparison(found, Path(output))
    return found


def plot(found: "Fit", folder: str | Path) -> list[Path]:
    """Draw all figures of a fit into a folder, PNG and SVG.

    Args:
        found: The fit.
        folder: Where to; made if missing.

    Returns:
        The files written.

    Raises:
        StoreError: The folder cannot be written.
    """
    from bowdenfit.questions.summary.figures import figure_data
    from bowdenfit.results.folder import made

    with made(Path(folder)) as place:
        return draw(figure_data(found), place)


def load(path: str | Path) -> "Fit":
    """A fit from its results folder, bit for bit as it was saved.

    Raises:
        StoreError: The folder is missing, unfinished or damaged.
    """
    from bowdenfit.front_desk import Fit

    return Fit.load(path)


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
    *,
    quantity: str | None = None,
    wrap_angles: Sequence[tuple[float, str]] = (),
    preload: tuple[float, str] | None = None,
    friction_limit: tuple[float, str] | None = None,
) -> list[dict[str, Any]]:
    """Efficiency, output force, or what stretch and preload do, with intervals; one row a route value or wrap angle.

    Args:
        found: The fit.
        lengths: Route values; the description's choices if omitted.
        input_force: Force at the motor side and its unit; efficiencies are predicted if omitted.
        stroke: "pull" or "return".
        quantity: "efficiency", "output-force", "preload", "friction", "slack-load", "position", "stiffness" or
            "preload-window"; all but the first two are asked at wrap angles.
        wrap_angles: Angles and units, in place of route values; those measured at if a quantity is asked and none is named.
        preload: Preload in place of the cable's own, with its unit.
        friction_limit: What may be felt in free motion, with its unit, for the preload window.

    Raises:
        UsageError: There is nothing to predict at, no posterior, or the cable has not what is asked for.
    """
    import numpy as np

    from bowdenfit.questions.predict.lengths import predicted_rows

    route = found.dataset.description.route
    if quantity is None:
        quantity = "efficiency" if input_force is None else "output-force"
    of_elastic = quantity not in {"efficiency", "output-force"}
    if wrap_angles or of_elastic or (route is None and found.model.cable.is_loop):
        from bowdenfit.questions.predict.bends import predicted_at_bends, question

        if lengths is not None:
            raise UsageError("predict at lengths or at wrap angles, not at both; leave one of them out.")
        found.draws()
        asked = question(found, wrap_angles, input_force, preload, friction_limit, stroke)
        return predicted_at_bends(found, quantity, asked)
    if preload is not None or friction_limit is not None:
        raise UsageError(
            "--preload and --friction-limit belong to predictions at wrap angles; name some, as --wrap-angle 90deg."
        )
    if quantity == "efficiency" and input_force is not None:
        raise UsageError(
            "--quantity efficiency at lengths is that at the fit's own reference force; leave --input-force out."
        )
    if lengths is None and route is not None and not route.choices:
        raise UsageError("the description has no choices; name the lengths to predict at.")
    wanted = np.asarray(lengths if lengths is not None else route.choices if route else [0.0], dtype=float)
    return predicted_rows(found, wanted, input_force, stroke)


def simulate(
    bench: str | Path,
    *,
    output: str | Path | None = None,
    seed: int | None = None,
    noise: bool = True,
    recordings: bool = False,
) -> Dataset:
    """Make a data set from known truth.

    Args:
        bench: A cable.toml with [truth] and [design], or with [truth] and [recordings].
        output: Folder to write the tables, the truth and the seed to; nothing is written if omitted, which recordings
            do not allow.
        seed: Seed; drawn and recorded if omitted.
        noise: Whether readings scatter.
        recordings: Whether to simulate recordings sample by sample, with the faults of a bench, instead of tables.

    Raises:
        BowdenfitError: What is wrong, in a sentence.
    """
    import jax

    seed = secrets.randbelow(LARGEST_SEED) if seed is None else seed
    if output is not None and Path(output).exists() and any(p.name != Path(bench).name for p in Path(output).iterdir()):
        raise StoreError(f"{output} exists already; name another folder with --output, nothing was written.")
    if recordings:
        return _simulated_recordings(Path(bench), output, seed, noise)
    from bowdenfit.questions.simulate.tables import make, read_bench, write

    plan = read_bench(Path(bench))
    with jax.enable_x64(True):
        dataset, truth = make(plan, jax.random.key(seed), noise)
    if output is not None:
        write(plan, dataset, truth, Path(output), seed)
    return dataset


def _simulated_recordings(bench: Path, output: str | Path | None, seed: int, noise: bool) -> Dataset:
    import jax

    from bowdenfit.questions.simulate.recordings import make_recordings, read_recordings_plan, write_recordings

    if output is None:
        raise UsageError("simulated recordings are files; name a folder for them with output.")
    plan = read_recordings_plan(bench)
    with jax.enable_x64(True):
        made = make_recordings(plan, seed, noise)
    write_recordings(made, Path(output))
    return load_dataset(Path(output))
