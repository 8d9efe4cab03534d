"""What figures show of recordings: blocks, phases, and the band of output forces that the fit allows."""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from bowdenfit.cable.load_cells import BLOCK_NOISE, RUN_SCATTER
from bowdenfit.cable.noise import noise_law
from bowdenfit.kinds.recordings.blocks import RECORDED
from bowdenfit.questions.recorded.equations import DRAWS, Follower, blocks_shown
from bowdenfit.questions.recorded.loop_equations import loop_follower
from bowdenfit.questions.recorded.rate import SHOWN_SPEED, place_of
from bowdenfit.questions.summary.figure_data import Dependence, RecordedTrace
from bowdenfit.recordings.recording import PULL, Recording, Recordings
from bowdenfit.results.record import Record

_QUANTILES = (0.05, 0.5, 0.95)
_LAGS = 60
_REACH = 0.1  # mounting effects of a run that are looked at, either way
_GRID = 60
_BINS = 12
_CURVES = 4000  # draws of a curve


def traces(fit: Record) -> tuple[RecordedTrace, ...]:
    """Every recording of a fit, as figures show it."""
    recordings = fit.dataset.measurements.recordings
    if recordings is None:
        return ()
    with jax.enable_x64(True):
        kind = loop_follower if recordings.loop else Follower
        follower = kind(fit.model, recordings, fit.dataset.measurements.angles)
        predicted, exponent = _predicted(fit, recordings, follower)
        fitted = _fitted(fit, recordings, follower)
    efficiency = _no_efficiencies(recordings) if recordings.loop else _run_efficiencies(fit)
    return tuple(
        _trace(fit, r, predicted[:, :, i], fitted[:, i], exponent[:, i], efficiency[r.run])
        for i, r in enumerate(recordings.each)
    )


def velocity_unit(fit: Record) -> str:
    """Unit in which velocities are shown; empty without any."""
    recordings = fit.dataset.measurements.recordings
    return SHOWN_SPEED[recordings.velocity_unit][0] if recordings is not None else ""


def _some_draws(fit: Record, n: int = DRAWS) -> np.ndarray:
    """So many draws of the posterior, or as many times least squares."""
    if fit.posterior is None:
        return np.repeat(fit.least_squares.z[None], n, axis=0)
    flat = fit.posterior.flat_z
    return flat[np.linspace(0, len(flat) - 1, n).astype(int)]


def _predicted(fit: Record, recordings: Recordings, follower: Follower) -> tuple[np.ndarray, np.ndarray]:
    """Quantiles of the output force with a new mounting, and of the friction exponent without."""
    z, n = _some_draws(fit), len(recordings.each)
    if fit.posterior is None:
        force, exponent = follower(z, np.zeros((DRAWS, n)))
        return force[:1], exponent[:3]
    tau = fit.posterior.values[RUN_SCATTER].ravel() if RUN_SCATTER in fit.posterior.values else np.zeros(1)
    scatter = tau[np.linspace(0, len(tau) - 1, DRAWS).astype(int)]
    law, generator = noise_law(fit.dataset.description), np.random.default_rng([fit.provenance.seed, 4])
    mounting = scatter[:, None] * law.draw_with(generator, (DRAWS, n))
    force, exponent = follower(z, mounting)
    return np.quantile(force, _QUANTILES, axis=0), np.quantile(exponent, _QUANTILES, axis=0)


def _fitted(fit: Record, recordings: Recordings, follower: Follower) -> np.ndarray:
    """Output force with the mounting effect of each run that suits its recordings best, by looking at many."""
    center = np.median(_some_draws(fit), axis=0)
    grid = np.linspace(-_REACH, _REACH, DRAWS)
    force, _ = follower(np.repeat(center[None], DRAWS, axis=0), np.repeat(grid[:, None], len(recordings.each), axis=1))
    columns = []
    for i, recording in enumerate(recordings.each):
        shown = blocks_shown(len(recording.blocks.time))
        used, measured = recording.strokes.used_sliding[shown], recording.blocks.output_force[shown]
        apart = np.abs(_apart(force[:, : len(shown), i], measured, recordings.loop))
        columns.append(force[int(np.argmin(np.median(apart[:, used], axis=1))) if used.any() else 0, :, i])
    return np.stack(columns, axis=1)


def _apart(one: np.ndarray, other: np.ndarray, loop: bool) -> np.ndarray:
    """How far forces are apart: their log ratio; of a loop, which pass through zero, their difference [N]."""
    return one - other if loop else np.log(np.maximum(one, 1e-3) / np.maximum(other, 1e-3))


@dataclass(frozen=True)
class _RunEfficiency:
    """Of one run: expected quantiles, as measured, and the standard error of that from its readings alone."""

    expected: np.ndarray
    measured: float
    sd: float


def _run_efficiencies(fit: Record) -> dict[str, _RunEfficiency]:
    recordings = fit.dataset.measurements.recordings
    assert recordings is not None  # the caller asked
    term = next(t for t in fit.model.terms if t.name == RECORDED)
    observed = term.observed()
    sigma = float(np.median(fit.posterior.values[BLOCK_NOISE])) if fit.posterior is not None else float("nan")
    weight = np.asarray(term.data.get("run_weight", np.full(len(observed), np.nan)), dtype=float)
    found = {}
    for i, run in enumerate(recordings.runs):
        if fit.posterior is not None:
            expected = np.quantile(fit.posterior.expected[RECORDED][..., i], _QUANTILES)
        else:
            expected = np.repeat(fit.least_squares.readings[RECORDED][i], 3)
        found[run] = _RunEfficiency(expected, float(observed[i]), float(observed[i] * sigma / np.sqrt(weight[i])))
    return found


def _no_efficiencies(recordings: Recordings) -> dict[str, _RunEfficiency]:
    """Of a loop, whose efficiency depends on the load: no quantiles, and nothing measured."""
    return dict.fromkeys(recordings.runs, _RunEfficiency(np.zeros(0), float("nan"), float("nan")))


def _trace(
    fit: Record,
    recording: Recording,
    predicted: np.ndarray,
    fitted: np.ndarray,
    exponent: np.ndarray,
    efficiency: _RunEfficiency,
) -> RecordedTrace:
    blocks, strokes, flagged = recording.blocks, recording.strokes, recording.account.flagged
    shown = blocks_shown(len(blocks.time))
    n, used = len(shown), strokes.used_sliding[shown]
    of_all = fit.dataset.measurements.recordings
    assert of_all is not None  # it has this one
    scale = SHOWN_SPEED[of_all.velocity_unit][1]
    deviation = _apart(blocks.output_force[shown], fitted[:n], of_all.loop)[used]
    step = float(np.median(np.diff(blocks.time[shown]))) if n > 1 else 1.0
    correlation = _autocorrelation(deviation)
    return RecordedTrace(
        recording.name,
        recording.run,
        blocks.time[shown],
        blocks.input_force[shown],
        blocks.output_force[shown],
        blocks.velocity[shown] * scale,
        strokes.stroke[shown],
        used,
        blocks.saturated[shown],
        predicted[:, :n],
        fitted[:n],
        exponent,
        strokes.exponent,
        efficiency.expected,
        efficiency.measured,
        efficiency.sd,
        step * np.arange(len(correlation)),
        correlation,
        flagged.kind,
        flagged.time,
        flagged.input_force,
        flagged.output_force,
    )


def _autocorrelation(deviation: np.ndarray) -> np.ndarray:
    """Autocorrelation at lags from 0; just the first where there are too few blocks."""
    centered = deviation - deviation.mean() if len(deviation) else deviation
    if len(centered) < 8 or not np.any(centered):
        return np.ones(1)
    lags = min(_LAGS, len(centered) // 3)
    products = [float(np.dot(centered[: len(centered) - k], centered[k:])) for k in range(lags)]
    return np.array(products) / products[0]


def dependences(fit: Record) -> tuple[Dependence, ...]:
    """How efficiency depends on load and speed, where the friction model lets it."""
    friction, recordings = fit.model.cable.friction, fit.dataset.measurements.recordings
    if recordings is None or not friction.options:
        return ()
    found = []
    if friction.depends_on_load:
        found.append(_on_load(fit, recordings))
    if friction.depends_on_rate:
        found.append(_on_speed(fit, recordings))
    return tuple(found)


def _place(fit: Record, recordings: Recordings) -> tuple[float, list[Recording], str]:
    """The route value with most recordings, those recordings, and the place in words."""
    at, place = place_of(fit)
    return at, [r for r in recordings.each if not place or r.route == at], place


def _on_load(fit: Record, recordings: Recordings) -> Dependence:
    at, here, place = _place(fit, recordings)
    used = [(r, r.strokes.used_sliding & (r.strokes.stroke == PULL)) for r in here]
    forces = np.concatenate([r.blocks.input_force[u] for r, u in used] or [np.array([10.0, 100.0])])
    grid = np.linspace(max(forces.min(), 1e-3), forces.max(), _GRID)
    points = [_binned(r, u) for r, u in used if u.any()]
    quantiles, constant = _curves(fit, at, grid, None)
    x, y, label = _joined(points, [r.run for r, u in used if u.any()])
    return Dependence("load", "Input force (N)", grid, quantiles, constant, x, y, label, place)


def _on_speed(fit: Record, recordings: Recordings) -> Dependence:
    at, here, place = _place(fit, recordings)
    unit, scale = SHOWN_SPEED[recordings.velocity_unit]
    low, high = fit.model.cable.friction.conditions.speeds
    grid = np.linspace(low * 0.5, high * 1.05, _GRID)
    points = []
    for r in here:
        used = r.strokes.used_sliding & (r.strokes.stroke == PULL) & np.isfinite(r.blocks.velocity)
        ratio = np.log(r.blocks.output_force[used] / r.blocks.input_force[used])
        points.append((np.array([np.abs(r.blocks.velocity[used]).mean() * scale]), np.exp([ratio.mean()])))
    quantiles, constant = _curves(fit, at, None, grid)
    x, y, label = _joined(points, [r.run for r in here])
    return Dependence("speed", f"Speed ({unit})", grid * scale, quantiles, constant, x, y, label, place)


def _joined(
    points: list[tuple[np.ndarray, np.ndarray]], runs: list[str]
) -> tuple[np.ndarray, np.ndarray, tuple[str, ...]]:
    labels = tuple(run for (x, _), run in zip(points, runs, strict=True) for _ in x)
    nothing = [np.zeros(0)]
    return np.concatenate([x for x, _ in points] or nothing), np.concatenate([y for _, y in points] or nothing), labels


def _binned(recording: Recording, used: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean input force and mean efficiency of blocks of similar load."""
    force = recording.blocks.input_force[used]
    efficiency = recording.blocks.output_force[used] / force
    order = np.array_split(np.argsort(force), min(_BINS, len(force)))
    return np.array([force[part].mean() for part in order]), np.array([efficiency[part].mean() for part in order])


def _curves(fit: Record, at: float, forces: np.ndarray | None, speeds: np.ndarray | None) -> tuple[np.ndarray, float]:
    """Quantiles of the efficiency while pulling against load or speed, and the efficiency at the reference."""
    model, friction = fit.model, fit.model.cable.friction
    where = jnp.asarray([at])

    def efficiency(z: jax.Array) -> tuple[jax.Array, jax.Array]:
        values = model.space.constrain(z)
        exponent = model.cable.exponent_at(values, where)[0]
        reference = friction.efficiency(values, exponent)
        if forces is not None:
            x = jnp.asarray(forces)
            return friction.output_force(values, x, exponent, jnp.ones(())) / x, reference
        x = jnp.asarray(friction.conditions.reference_force)
        shift = exponent * friction.rate(values, jnp.asarray(speeds))
        return friction.output_force(values, x, shift, jnp.ones(())) / x, reference

    with jax.enable_x64(True):
        curves, reference = jax.jit(jax.vmap(efficiency))(jnp.asarray(_some_draws(fit, _CURVES)))
    constant = float(np.median(np.asarray(reference)))
    if fit.posterior is None:
        return np.asarray(curves)[:1], constant
    return np.quantile(np.asarray(curves), _QUANTILES, axis=0), constant
