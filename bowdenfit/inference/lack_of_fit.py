r"""Lack of fit: do residuals depend on where the readings were taken? Then the model does not describe them.

For each way in which a table could depart from the model (with the load, the stroke, the speed, the order, the position) the
columns of that departure, minus what the parameters can follow, are fitted to the residuals of least squares. Without a
departure the sum of squares that they explain, over the remaining one, is F distributed. With many readings the test is
repeated with a heteroskedasticity-consistent covariance, and the larger of the two p-values counts. A zero that drifts during a
recording, as s t / F_out, is small beside the loss and may still move coefficients: it is judged by how far a refit without it
moves them.

References:
    Draper and Smith, Applied Regression Analysis, 3rd ed., Wiley 1998, chapters 2 and 6: lack of fit, extra sums of squares.
    White, A heteroskedasticity-consistent covariance matrix estimator, Econometrica 48 (1980), 817.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, cast

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from scipy.special import fdtrc, stdtr

from bowdenfit.cable.departure import DEPARTURE_SHARES
from bowdenfit.inference.bench_errors import learn_at_minimum
from bowdenfit.inference.compilation import compile_program
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.objective import Solution
from bowdenfit.inference.profiles import Basin
from bowdenfit.inference.residual_groups import ResidualGroup, ResidualGroups, explain_residuals, group_residuals
from bowdenfit.inference.scalar_priors import clipped_z
from bowdenfit.kinds.plausibility import MOST_LEVELS
from bowdenfit.kinds.runs import RunsData
from bowdenfit.kinds.sliding_rows import OFFSET, ORDER, SPEED, STROKE, ZERO
from bowdenfit.kinds.term import GROUP, LOAD, WRAP_ANGLE
from bowdenfit.models import Model

# Probability that a fit of a correct model is reported not to describe its readings; `tests/inference/test_lack_of_fit.py`.
FALSE_ALARM = 0.003
NOTICEABLE_SIZE = 0.02  # relative size of the departure below which it is not reported; a judgement
# Judgement: shift of a coefficient by a drifting zero, over half of its 90 % interval, above which the drift is reported.
NOTICEABLE_SHIFT = 0.5
_FRICTION = ("friction", "friction_model")  # roles of the parameters that a drifting zero could move
_KINDS_BY_KEY = {"angle": ("angle_offset",), "zero": ("input_zero", "output_zero")}  # of errors whose key has another name
# Judgements below; `scripts/check_benches.py` counts the false alarms that they give together.
_MANY = 30  # readings from which the heteroskedasticity-consistent test is used too
_CURVE_DEGREE, _POSITION_DEGREE = 4, 2  # degree of the polynomials tested for curves, and for other readings
_LEAST_FREEDOM = 2.0  # degrees of freedom below which nothing is tested
_LEAST_OUTLIER_FREEDOM = 5.0  # degrees of freedom from which one reading can be distinguished from the scatter of the others
_PLAUSIBLE_SCATTER = (1e-3, 1e3)  # limits of the scatter, relative to what its prior expects
_FOLLOWED = 1e-3  # share of a column that must be left after the parameters have followed it


@dataclass(frozen=True)
class Departure:
    """One way in which the readings of a table depart from the model.

    Args:
        table: Name of the readings.
        group: Contact or other group of the readings; empty where there are no groups.
        against: Axis label of the quantity that they depend on.
        inside: Whether these are readings inside runs; otherwise whole runs, or single readings.
        p_value: Bonferroni-adjusted p-value: that of this departure times the number of departures that were tested.
        size: Root mean square of the departure, relative to that of the readings [1].
        low, high: Mean position of the lowest third and of the highest third of the readings; for a drifting zero, its value at
            the start and at the end of a run, relative to its middle [N]; for an offset 0, and that of the output [N].
        at_low, at_high: By how much readings there exceed the model, relative to the readings [1].
        moved: For a drifting zero, whose size says little: the largest shift of a friction coefficient, over half of its 90 %
            interval; 0 where the drift is not significant. None for all others.
    """

    table: str
    group: str
    against: str
    inside: bool
    p_value: float
    size: float
    low: float
    high: float
    at_low: float
    at_high: float
    moved: float | None = None

    @property
    def is_noticeable(self) -> bool:
        """Whether the departure is significant and large enough to matter."""
        matters = self.size > NOTICEABLE_SIZE if self.moved is None else self.moved > NOTICEABLE_SHIFT
        return self.p_value < FALSE_ALARM and matters


@dataclass(frozen=True)
class FarReading:
    """An outlier: a reading farther from the fit than expected of any reading.

    Args:
        table: Name of the readings.
        label: Label of the reading.
        p_value: Probability that any reading of a correct model lies as far out.
        sds: Distance from the fit in standard deviations of the other readings.
    """

    table: str
    label: str
    p_value: float
    sds: float


def find_departures(
    basin: Basin, scale: np.ndarray, reach: Mapping[str, float]
) -> tuple[tuple[Departure, ...], tuple[FarReading, ...]]:
    """Test every departure; return them by p-value, smallest first, and single readings that are outliers.

    What an error of the bench explains whose limit the user states is no departure, because the answers include it; nor is what
    a gain explains within the usual limit, which both strokes show of nearly every bench with two good load cells. Other usual
    limits explain nothing here, because another model may be the reason: a curve that cannot follow the angles, or friction
    that depends on the load.

    Args:
        basin: The minimum of least squares.
        scale: Scatter of every standardized residual about the minimum.
        reach: Half of the 90 % interval of each identified parameter, in its shown unit.
    """
    model = basin.problem.posterior.model
    keys, reweighed = model.description.errors.model_fields_set, _reweigh_by_scatter(basin, model, scale)
    departures, outliers = _test_all(basin, _correct_bench_errors(basin, reweighed, keys), reach)
    if "gain" not in keys and any(departure.is_noticeable for departure in departures):
        departures, outliers = _test_all(basin, _correct_bench_errors(basin, reweighed, {*keys, "gain"}), reach)
    return departures, outliers


def _test_all(
    basin: Basin, reweighed: Solution, reach: Mapping[str, float]
) -> tuple[tuple[Departure, ...], tuple[FarReading, ...]]:
    """Return every departure of a solution, by p-value, and its outliers."""
    model = basin.problem.posterior.model
    system = group_residuals(model, reweighed)
    candidates = [departure for readings in system.readings for departure in _test_departures(system, readings)]
    if model.description.fits_offsets:  # of which nothing is left but what the linear approximation lacks
        candidates = [departure for departure in candidates if departure.against != OFFSET]
    candidates += _test_curves(basin.problem.posterior, reweighed, system)
    corrected = (replace(departure, p_value=min(departure.p_value * len(candidates), 1.0)) for departure in candidates)
    assessed = (_assess_zero(basin, reach, system, d) if d.against in (ZERO, OFFSET) else d for d in corrected)
    ordered = tuple(sorted(assessed, key=lambda departure: (departure.p_value, -departure.size)))
    return ordered, _find_far_readings(system)


def _assess_zero(basin: Basin, reach: Mapping[str, float], system: ResidualGroups, departure: Departure) -> Departure:
    """Estimate an offset, or a drifting zero and how far it moves coefficients, by a refit without it in the readings."""
    readings = next(r for r in system.readings if r.table == departure.table and r.inside)
    x, whole = readings.at[departure.against], np.zeros(len(system.residuals))
    whole[readings.rows] = x / (readings.unit * readings.scatter)
    remaining = whole - system.followed @ (system.followed.T @ whole)
    drift = float(remaining @ system.residuals / (remaining @ remaining))
    if departure.against == OFFSET:
        return replace(departure, low=0.0, high=drift)
    ends = _compare_thirds(readings, readings.at[ORDER], np.ones(len(x), dtype=bool))[2:]
    drifting = replace(departure, low=-drift, high=drift, at_low=ends[0], at_high=ends[1], moved=0.0)
    if departure.p_value >= FALSE_ALARM:
        return drifting
    problem, z = basin.problem, basin.solution["z"]
    terms = zip(problem.posterior.model.terms, problem.posterior.data, strict=True)
    data = tuple(_subtract_drift(term, of, x * drift) if term.name == departure.table else of for term, of in terms)
    steady = replace(problem, posterior=replace(problem.posterior, data_override=data)).solve(z, basin.at_end, z)
    shift = np.abs(steady["values"] - basin.solution["values"])
    friction = [(i, p) for i, p in enumerate(basin.parameters) if p.role in _FRICTION and reach.get(p.name, 0) > 0]
    return replace(
        drifting, moved=max((float(shift[i]) * p.shown_scale / reach[p.name] for i, p in friction), default=0.0)
    )


def _subtract_drift(term: Any, data: RunsData, more: np.ndarray) -> RunsData:
    """Return data of runs with a correction subtracted from each log ratio inside them."""
    cell, weight = term.inside.cell, term.inside.weight
    n = len(data.cells.mean)
    mean = np.bincount(cell, weight * more, n) / np.maximum(np.bincount(cell, weight, n), 1e-300)
    return replace(data, cells=replace(data.cells, mean=data.cells.mean - mean))


def _find_far_readings(system: ResidualGroups) -> tuple[FarReading, ...]:
    """Find outliers by externally studentized residuals (Draper and Smith, chapter 8).

    Readings inside runs are left out, because their noise may grow with the load.
    """
    whole = [r for r in system.readings if not r.inside and r.freedom >= _LEAST_OUTLIER_FREEDOM]
    far_readings, among = [], sum(int(np.sum(readings.used)) for readings in whole)
    for readings in whole:
        residuals, freedom = system.residuals[readings.rows], readings.freedom
        left = np.maximum(1 - np.sum(system.followed[readings.rows] ** 2, axis=1), 0.0)
        share = residuals**2 / (np.maximum(left, _FOLLOWED) * np.sum(residuals**2))  # of all scatter, the reading's own
        t = np.sqrt((freedom - 1) * share / np.maximum(1 - share, 1e-12))
        p_value = np.where(readings.used & (left > _FOLLOWED), 2 * stdtr(freedom - 1, -t) * among, 1.0)
        far = np.flatnonzero(p_value < FALSE_ALARM)
        far_readings += [FarReading(readings.table, readings.labels[i], float(p_value[i]), float(t[i])) for i in far]
    return tuple(sorted(far_readings, key=lambda reading: reading.p_value))


def _reweigh_by_scatter(basin: Basin, model: Model, scale: np.ndarray) -> Solution:
    """Solve again with each table weighted by the scatter that was found, not by the scatter that its prior expects.

    Otherwise a table that scatters far less than expected is pulled off its own best fit by the others, and seems not to fit.
    """
    problem, solution, index = basin.problem, basin.solution, model.space.index
    pin, start = np.where(problem.noise, 0.0, solution["z"]), 0
    for term in model.terms:
        names = (term.noise, getattr(term, "reading_noise", ""))
        for name, (count, _) in zip(names, term.residual_blocks, strict=False):
            if name in index and count:
                at = index[name]
                value = np.clip(scale[start], *_PLAUSIBLE_SCATTER) * solution["values"][at]
                prior = model.space.free[at].prior
                pin[at] = clipped_z(prior, value)
            start += count
    reweighed = problem.solve(solution["z"], basin.at_end, pin)
    return reweighed if reweighed["succeeded"] and np.all(np.isfinite(reweighed["jacobian"])) else solution


def _correct_bench_errors(basin: Basin, solution: Solution, keys: Collection[str]) -> Solution:
    """Return a solution without what errors of the bench explain of its residuals, as far as their limits let them.

    Args:
        basin: The minimum of least squares.
        solution: The solution.
        keys: The errors that count, by their keys under [errors].
    """
    learned = learn_at_minimum(basin.problem, solution["z"], basin.at_end) if keys else None
    if learned is None:
        return solution
    mean = learned.mean_of({kind for key in keys for kind in _KINDS_BY_KEY.get(key, (key,))})
    explained = (learned.columns + solution["jacobian"] @ learned.moves) @ mean
    residuals, start = {}, 0
    for table, of_table in solution["residuals"].items():
        residuals[table] = of_table + explained[start : start + len(of_table)]
        start += len(of_table)
    inside = {table: columns @ mean for table, columns in learned.inside.items()}
    return solution | {"residuals": residuals, "inside": inside}


def _test_departures(system: ResidualGroups, readings: ResidualGroup) -> Iterator[Departure]:
    """Yield the tested departures of one table."""
    for group in dict.fromkeys(readings.group):
        selected = readings.used & (np.array(readings.group) == group)
        for against, x in readings.at.items():
            if not (selected.any() and np.all(np.isfinite(x[selected])) and np.ptp(x[selected]) > 0):
                continue
            for columns in _departure_columns(against, x, selected, bool(group), against in readings.unused):
                lever = np.ones(len(x)) if against in (ZERO, OFFSET) else readings.lever
                by_speed = _speed_columns(readings, selected) if against == ORDER else np.zeros((len(x), 0))
                columns = np.hstack([columns, by_speed])
                scaled = np.where(selected[:, None], columns, 0.0) * lever[:, None]
                tested = _test_columns(system, readings, scaled, by_speed.shape[1])
                if tested is not None:
                    yield Departure(
                        readings.table,
                        group,
                        against,
                        readings.inside,
                        *tested,
                        *_compare_thirds(readings, x, selected),
                    )


def _test_curves(posterior: LogDensity, solution: Solution, system: ResidualGroups) -> Iterator[Departure]:
    """Test whether angles and forces together depart smoothly from the curve of each contact, and of all at once.

    A curve that is slightly wrong shifts forces as well as angles, and each of the two may be too few to show it.
    """
    model = posterior.model
    readings = next((r for r in system.readings if any(r.group) and set(r.group) <= set(model.cable.curves)), None)
    tested = [column for column, curve in model.cable.curves.items() if curve.has_family and not curve.departs]
    if readings is None or not tested or len(model.terms) == 1:  # angles alone were tested against their position
        return
    columns = _derive_by_departures(posterior, solution, tested)
    for group in [*([column] for column in tested), *([tested] if len(tested) > 1 else [])]:
        explained = explain_residuals(model, solution, np.concatenate([columns[column] for column in group], axis=1))
        if not explained.rank or explained.freedom < _LEAST_FREEDOM:
            continue
        p_value = float(fdtrc(explained.rank, explained.freedom, explained.squares / explained.rank))
        moved, read = explained.by_table[readings.table]
        parts = {column: np.array(readings.group) == column for column in group}
        sizes = {
            column: float(np.sqrt(np.mean(moved[part] ** 2) / np.mean(read[part] ** 2)))
            for column, part in parts.items()
            if np.any(read[part])
        }
        if sizes:
            column = max(sizes, key=lambda column: sizes[column])
            against, x = next(iter(readings.at.items()))
            thirds = _compare_thirds(readings, x, readings.used & parts[column])
            yield Departure(readings.table, column, against, False, p_value, sizes[column], *thirds)


def _derive_by_departures(posterior: LogDensity, solution: Solution, tested: Sequence[str]) -> dict[str, np.ndarray]:
    """Derivatives of all residuals by the functions of each curve's departure [1/rad], at none, by column of angles."""
    model = posterior.model
    cable = model.cable.departing(tested)
    terms: list[Any] = [replace(cast("Any", term), cable=cable) for term in model.terms]
    values = model.space.named(jnp.asarray(solution["values"]))
    curves = [cable.curves[column] for column in tested]

    def residuals(weights: Array, data: Any) -> Array:
        departures = {
            name: value
            for curve, of_curve in zip(curves, weights, strict=True)
            for name, value in zip(curve.weight_names, of_curve, strict=True)
        }
        return jnp.concatenate([term.residuals(values | departures, d) for term, d in zip(terms, data, strict=True)])

    none = np.zeros((len(curves), len(DEPARTURE_SHARES)))
    program = compile_program(jax.jacfwd(residuals), none, posterior.data, run_once=True)
    return dict(zip(tested, np.moveaxis(np.asarray(program(none, posterior.data)), 1, 0), strict=True))


def _speed_columns(readings: ResidualGroup, selected: np.ndarray) -> np.ndarray:
    """Return columns of friction that depends on the speed, which must not pass for a drift where the order goes by speed.

    Friction of Stribeck falls and rises again: the logarithm of the speed and its square.
    """
    speed = readings.at.get(SPEED)
    if speed is None or not np.all(np.isfinite(speed[selected])) or np.ptp(speed[selected]) == 0:
        return np.zeros((len(selected), 0))
    log = next(_departure_columns(SPEED, speed, selected, False, False))[:, 0]
    return np.stack([log, log**2], axis=1)


def _departure_columns(
    against: str, x: np.ndarray, selected: np.ndarray, of_curve: bool, is_unused: bool
) -> Iterator[np.ndarray]:
    """Yield columns for the ways in which readings could depend on where they were taken, (reading, column)."""
    levels = np.unique(x[selected])
    if is_unused and len(levels) <= min(MOST_LEVELS, selected.sum() // 2):
        yield (x[:, None] == levels[None, :]).astype(float)
    elif against == LOAD and np.all(x[selected] > 0):
        load = np.where(selected, x, 1.0)
        yield np.column_stack([np.log(load), np.min(x[selected]) / load])
        if 3 <= len(levels) <= min(MOST_LEVELS, selected.sum() // 2):
            yield (x[:, None] == levels[None, :]).astype(float)
    elif against == SPEED:
        yield np.log(np.maximum(np.where(selected, x, 1.0), np.max(x[selected]) / 1e3))[:, None]
    elif against in (STROKE, ZERO, OFFSET):
        yield x[:, None].astype(float)
    elif against == GROUP:
        yield (x[:, None] == levels[None, :]).astype(float)
    else:
        if against == WRAP_ANGLE:
            yield np.ones((len(x), 1))  # what is there without any bend: of all departures with the bend the likeliest
        low, high = np.min(x[selected]), np.max(x[selected])
        degree = min(_CURVE_DEGREE if of_curve else _POSITION_DEGREE, len(np.unique(x[selected])) - 1)
        yield np.polynomial.legendre.legvander(np.where(selected, 2 * (x - low) / (high - low) - 1, 0.0), degree)


def _test_columns(
    system: ResidualGroups, readings: ResidualGroup, columns: np.ndarray, n_given: int = 0
) -> tuple[float, float] | None:
    """Return the p-value of a departure and its size; None where it cannot be tested.

    Args:
        system: Residuals of all readings.
        readings: Those of one table.
        columns: The departure, (reading, column).
        n_given: How many columns at the end explain what they can before it.
    """
    whole = np.zeros((len(system.residuals), columns.shape[1]))
    whole[readings.rows] = columns / (readings.unit * readings.scatter)[:, None]
    whole /= np.maximum(np.linalg.norm(whole, axis=0), 1e-300)
    whole -= system.followed @ (system.followed.T @ whole)
    if n_given:
        explained, sizes, _ = np.linalg.svd(whole[:, -n_given:], full_matrices=False)
        explained = explained[:, sizes > _FOLLOWED]
        whole = whole[:, :-n_given] - explained @ (explained.T @ whole[:, :-n_given])
    u, s, _ = np.linalg.svd(whole, full_matrices=False)
    u = u[:, s > _FOLLOWED]
    along, k, part = u.T @ system.residuals, u.shape[1], u[readings.rows]
    freedom = readings.freedom - float(np.sum(part**2))  # the parameters carry some of a departure to other tables
    if k == 0 or freedom < _LEAST_FREEDOM:
        return None
    remaining = system.residuals[readings.rows] - part @ along
    variance = (float(np.sum(remaining**2)) + readings.extra) / freedom
    p_value = float(fdtrc(k, freedom, float(along @ along) / k / max(variance, 1e-300)))
    if len(remaining) >= _MANY:
        covariance = (part * remaining[:, None] ** 2).T @ part * (len(remaining) / max(len(remaining) - k, 1))
        robust = float(along @ np.linalg.lstsq(covariance, along, rcond=None)[0])
        p_value = max(p_value, float(fdtrc(k, freedom, robust / k)))
    moved = part @ along * readings.unit * readings.scatter
    of = readings.reading if readings.effect is None else readings.effect
    return p_value, float(np.sqrt(np.mean(moved**2) / max(np.mean(of**2), 1e-300)))


def _compare_thirds(readings: ResidualGroup, x: np.ndarray, selected: np.ndarray) -> Sequence[float]:
    """Return the mean positions of the lowest and the highest third, and by how much readings there exceed the model."""
    low, high = np.quantile(x[selected], (1 / 3, 2 / 3))
    thirds = [selected & (x <= low), selected & (x >= high)]
    return [float(np.mean(x[third])) for third in thirds] + [readings.excess(third) for third in thirds]
