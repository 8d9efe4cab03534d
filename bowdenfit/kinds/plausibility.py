"""Signs that readings do not come from a bench as they are: copied rows, displays too coarse to show noise, impossible values.

Copies count as measurements, and a copied run as another mounting, so that every interval is too narrow and nothing else shows
it. Two readings often agree to the last digit where a display is coarse, so copies are reported only where *all* rows of a run
are those of another, all rows appear equally often, or many rows follow each other as others did before, and where noise larger
than the last digit would hardly ever do that.

Someone who reads 14 N six times off a display of whole newtons knows the force to half a newton, and no better for the
repetition: a scatter estimated from differences between such readings is meaningless.

For simulated readings the limits of what a bench shows are wide, and the same for every kind.
"""

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import gcd
from typing import Any

import numpy as np
from jaxtyping import Float

from bowdenfit.kinds.rows import ForceRows, RowOrigin, UnusedColumn
from bowdenfit.types import Labels, Matrix, Vector
from bowdenfit.words import few, listed

GAIN_ERROR = 0.01  # relative gain error between load cells where none is stated; a judgement
LOWEST, HIGHEST = 0.2, 0.99  # efficiencies of a plausible bench; a judgement
_LEAST_LOSS, _LARGEST_LOSS = -np.log(HIGHEST), -np.log(LOWEST)
FACTOR = 10.0  # largest ratio of what is simulated to what was measured, either way; a judgement
SCATTER = 0.1  # largest scatter of log ratios of forces about their stroke's mean; a judgement


# Copies are called so where independent readings would agree with a probability below FALSE_ALARM: of 5000 healthy benches none
# is, and of pasted tables and copied runs 96 and 99 in 100 (docs/evidence/experiments.md, tests/kinds/test_copies.py).
FALSE_ALARM = 1e-6
_LEAST_FREEDOM = 3  # degrees of freedom of the scatter that is compared with the last digit
_FINE = 3.0  # least scatter in last digits: below it readings agree because they are rounded alike
NO_NOISE = 1e-5  # least scatter over the readings of a bench; with less they were computed. A judgement
_CALCULATED = 3e-3  # largest deviation, over the range of a column, that rounding leaves in what was calculated. A judgement
MOST_LEVELS = 24  # loads, or values of an unused column, up to which each may have friction of its own; a judgement
_DEGREE = 3  # degree of the smooth curve that readings follow; a judgement
_MULTIPLES = {2: "twice", 3: "three times", 4: "four times"}
_LEAST_AGAIN = 3  # repeated readings, all alike, from which a display is called coarse; a judgement
_POWERS = range(6, -10, -1)  # powers of ten that a last digit may be
_WHOLE = 1e-9  # relative rounding error of a multiple of the last digit, in double precision with room
_FEWEST_IN_BLOCK = 6  # rows in a row that repeat others, from which they may be a pasted part of a table; a judgement
_MOST_COMPARED = 4000  # rows that are compared with each other in a second
_FEWEST_VALUES, _MOST_VALUES = 8, 24  # different values that show the steps of a converter, and those that are enough
_STEPS_AT_ONCE = 20_000


def choose_unused_columns(unused: Mapping[str, np.ndarray], *readings: Vector) -> dict[str, UnusedColumn]:
    """Return the unused columns that may say under what circumstances readings were taken.

    Left out are columns that are the same throughout, texts of which hardly two are alike, and what was calculated from the
    readings of the same rows, such as an efficiency or a loss.

    Args:
        unused: Numbers or texts of columns that nothing reads, by heading.
        readings: Readings in the rows, and quantities that people calculate from them.
    """
    chosen = dict[str, UnusedColumn]()
    for heading, values in unused.items():
        levels, level = np.unique(values, return_inverse=True)
        if len(levels) < 2 or (values.dtype.kind == "f" and not np.all(np.isfinite(values))):
            continue
        if values.dtype.kind != "f":
            if len(levels) <= min(MOST_LEVELS, len(values) // 2):
                chosen[heading] = UnusedColumn(level.astype(float), tuple(str(text) for text in levels))
        elif not any(_is_calculated(values, reading) for reading in readings):
            chosen[heading] = UnusedColumn(values)
    return chosen


def _is_calculated(numbers: Vector, reading: Vector) -> bool:
    """Return whether numbers are a linear function of readings, or these themselves, as fractions or in percent, rounded."""
    columns = np.column_stack([np.ones(len(numbers)), reading])
    left = np.max(np.abs(numbers - columns @ np.linalg.lstsq(columns, numbers, rcond=None)[0]))
    rounded = min(float(np.max(np.abs(numbers - scale * reading))) for scale in (1.0, 100.0))
    half_a_digit = 0.51 * find_last_digit(np.abs(numbers[numbers != 0]))
    return bool(left <= _CALCULATED * np.ptp(numbers) or rounded <= half_a_digit)


def explain_impossible_loss(loss: np.ndarray, what: str) -> str:
    """Return why no cable has such friction exponents, in words; empty if one may.

    Args:
        loss: Friction exponents [1].
        what: Subject of the sentence.
    """
    if np.any(loss > _LARGEST_LOSS):
        return f"{what} is below 20 %"
    return f"{what} is above 99 %" if np.any(loss < _LEAST_LOSS) else ""


def split_by_group(group: np.ndarray, values: np.ndarray) -> list[np.ndarray]:
    """Split values by group, in order of the group's labels."""
    return [values[group == label] for label in np.unique(group)]


def is_within_factor(real: float, made: float) -> bool:
    """Return whether a simulated quantity is within a factor of `FACTOR` of the measured one."""
    return bool(real / FACTOR <= made <= real * FACTOR)


@dataclass(frozen=True)
class ComparedReadings:
    """Readings of a table, prepared for comparison with each other.

    Args:
        file: Name of the table.
        part: Number of the run of each row.
        names: Every run in words, such as "run 3"; none where the table has no runs.
        settings: Under what each row was read, a column a quantity; NaN where one is not known.
        read: Readings, one column per quantity; NaN if missing.
        along: Quantity that the readings change smoothly with.
        curve: Number of the curve on which a row lies: those of one run and stroke.
        origin: Where its rows were read; None where that is not known.
    """

    file: str
    part: Labels
    names: tuple[str, ...]
    settings: Float[np.ndarray, "rows settings"]
    read: Float[np.ndarray, "rows readings"]
    along: Vector
    curve: Labels
    origin: RowOrigin | None = None

    @property
    def rows(self) -> Matrix:
        """All columns of each row; -1 where nothing was read."""
        return np.nan_to_num(np.column_stack([self.settings, self.read]), nan=-1.0)


def compare_without_runs(
    origin: RowOrigin, settings: np.ndarray, read: np.ndarray, along: Vector, curve: Any = 0
) -> ComparedReadings:
    """Prepare a table without runs for comparison; its settings and readings may be one column.

    Args:
        origin: Where its rows were read.
        settings, read, along, curve: As of `ComparedReadings`; all rows lie on one curve if that is omitted.
    """
    n = len(along)
    none, curves = np.zeros(n, dtype=int), np.broadcast_to(np.asarray(curve), n)
    settings, read = settings.reshape(n, -1), read.reshape(n, -1)
    return ComparedReadings(listed(origin.files), none, (), settings, read, along, curves, origin)


def route_or_wrap_angle(rows: ForceRows) -> Vector:
    """Return the route value of each row, or its total wrap angle [rad] where there is no route."""
    return rows.route if np.isfinite(rows.route).all() else np.nansum(rows.own.angle, axis=1)


def describe_copies(compared: ComparedReadings) -> list[str]:
    """Describe readings that are copies of others, in sentences without first capital or remedy; empty if chance may do it."""
    rows = compared.rows
    parts = {int(k): np.flatnonzero(compared.part == k) for k in np.unique(compared.part)}
    alike, repeated, block = _find_equal_runs(rows, parts), _find_repeated_rows(rows, parts), _find_copied_block(rows)
    if not alike and not repeated and not block:
        return []
    chances, sentences = _agreement_probabilities(compared), []
    for same in alike:
        first, *others = (compared.names[k] for k in same)
        one = parts[same[0]]
        if _log_agreement_probability(chances, compared.read[one]) + 2 * np.log(len(parts)) < np.log(FALSE_ALARM):
            hold = "holds" if len(others) == 1 else "hold"
            sentences.append(
                f"{few(others)} of {compared.file} {hold} the same {len(one)} readings as {first}, to the last digit"
            )
    for times, those in repeated.items():
        positions = np.sort(np.concatenate([parts[k] for k in those]))
        if (1 - 1 / times) * _log_agreement_probability(chances, compared.read[positions]) < np.log(FALSE_ALARM):
            whose = f" of {few(compared.names[k] for k in those)}" if len(those) < len(parts) else ""
            often = _MULTIPLES.get(times, f"{times} times")
            sentences.append(f"every reading{whose} in {compared.file} stands there {often}, to the last digit")
            if pasted := _describe_block(compared, *_halves(rows, positions, times)):
                sentences[-1] += f": {pasted}"
    if not sentences and block:
        original, again = block
        chance = _log_agreement_probability(chances, compared.read[original]) + 2 * np.log(len(rows))
        pasted = _describe_block(compared, original, again)
        sentences += [f"{pasted}, to the last digit"] if pasted and chance < np.log(FALSE_ALARM) else []
    return sentences


def _halves(rows: Matrix, where: np.ndarray, times: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the rows of which the others among some are copies in the same order, and these; both empty in another order."""
    first, again = where[: len(where) // times], where[len(where) // times :]
    same = np.array_equal(np.tile(rows[first], (times - 1, 1)), rows[again])
    return (first, again) if same else (where[:0], where[:0])


def _describe_block(compared: ComparedReadings, first: np.ndarray, again: np.ndarray) -> str:
    """Return which rows of which file are copies of which; empty where they do not stand one below the other."""
    if compared.origin is None or len(first) == 0 or np.any(np.diff(first) != 1) or np.any(np.diff(again) != 1):
        return ""
    origin = compared.origin
    places = [(origin.file[at[0]], origin.file[at[-1]], origin.row[at[0]], origin.row[at[-1]]) for at in (again, first)]
    if any(file != last for file, last, _, _ in places):
        return ""
    (file, _, start, stop), (other, _, first_start, first_stop) = places
    copies = f"rows {start} to {stop} of {origin.files[file]} are copies of rows {first_start} to {first_stop}"
    return copies if file == other else f"{copies} of {origin.files[other]}"


def _find_copied_block(rows: Matrix) -> tuple[np.ndarray, np.ndarray] | None:
    """Return the longest stretch of rows that follow each other as others did before, which come first; None without one."""
    labels = np.unique(rows, axis=0, return_inverse=True)[1].ravel()
    best, start, n = 0, (0, 0), len(labels)
    if len(np.unique(labels)) == n or n > _MOST_COMPARED:
        return None
    for shift in range(_FEWEST_IN_BLOCK, n - _FEWEST_IN_BLOCK + 1):
        ends = np.flatnonzero(np.append(labels[:-shift] != labels[shift:], True))
        lengths = np.diff(ends, prepend=-1) - 1
        longest = int(np.argmax(lengths))
        length = min(int(lengths[longest]), shift)
        if length > best:
            begin = int(ends[longest] - lengths[longest])
            best, start = length, (begin, begin + shift)
    block = np.arange(best)
    return (start[0] + block, start[1] + block) if best >= _FEWEST_IN_BLOCK else None


def _find_equal_runs(rows: Matrix, parts: Mapping[int, np.ndarray]) -> list[list[int]]:
    """Return groups of runs that hold the same rows, in whatever order."""
    known: dict[bytes, list[int]] = defaultdict(list)
    for k, where in parts.items():
        known[rows[where][np.lexsort(rows[where].T)].tobytes()].append(k)
    return [same for same in known.values() if len(same) > 1]


def _find_repeated_rows(rows: Matrix, parts: Mapping[int, np.ndarray]) -> dict[int, list[int]]:
    """Return runs in which every row stands equally often, by how often that is, if more than once."""
    runs_by_count: dict[int, list[int]] = defaultdict(list)
    for k, where in parts.items():
        times = gcd(*Counter(row.tobytes() for row in rows[where]).values())
        if times > 1:
            runs_by_count[times].append(k)
    return runs_by_count


def _log_agreement_probability(chances: Float[np.ndarray, " columns"], read: Matrix) -> float:
    """Return the logarithm of the probability that as many other readings are the same."""
    return float(np.sum(np.isfinite(read).sum(axis=0) * np.log(chances)))


def _agreement_probabilities(compared: ComparedReadings) -> Float[np.ndarray, " readings"]:
    """Return the probability that two readings of one quantity agree to the last digit, by column; 1 where it is unknown.

    By the step of the display q and the scatter s about a smooth curve: the difference of two normal readings falls into a
    class of width q with a chance of q / (2 sqrt(pi) s), which is an upper bound where their means differ.
    """
    probabilities = np.ones(compared.read.shape[1])
    for c, read in enumerate(compared.read.T):
        finite = np.isfinite(read) & np.isfinite(compared.along)
        curves = [finite & (compared.curve == curve) for curve in np.unique(compared.curve[finite])]
        points = [np.unique(np.column_stack([compared.along[mask], read[mask]]), axis=0) for mask in curves]
        squares, freedom = _sum_residuals(points, _DEGREE)
        if freedom < _LEAST_FREEDOM and _are_all_different(points):
            squares, freedom = _sum_residuals(points, 1)  # three readings in each run leave some about straight lines
        values = np.unique(read[finite])
        if freedom < _LEAST_FREEDOM or len(values) < 2:
            continue
        scatter = np.sqrt(squares / freedom)
        last_digit = find_display_step(values)
        if scatter > max(_FINE * last_digit, NO_NOISE * np.sqrt(np.mean(values**2))):
            probabilities[c] = last_digit / (2 * np.sqrt(np.pi) * scatter)
    return probabilities


def find_display_step(values: Vector) -> float:
    """Return the step in which a display or converter counts: the largest of which all values may be rounded multiples.

    A converter with steps of 0.0488 N shows 0.049, 0.098 and 0.146 N. Where there are too few values to see its steps, the
    smallest difference is an upper bound of them.

    Args:
        values: Different values, in increasing order.
    """
    smallest, last_digit = float(np.diff(values).min()), find_last_digit(np.abs(values[values != 0]))
    if last_digit == 0 or len(values) < _FEWEST_VALUES:
        return smallest
    some = values[:: max(len(values) // _MOST_VALUES, 1)][:_MOST_VALUES]
    counts = np.round((some - some[0]) / last_digit)
    fineness = 1 / (2 * counts.max())  # so fine that the largest count moves by half of one
    logs = np.arange(np.log(max(smallest / last_digit, 2.0)), np.log(2.0) - fineness, -fineness)
    for begin in range(0, len(logs), _STEPS_AT_ONCE):
        steps = np.exp(logs[begin : begin + _STEPS_AT_ONCE])[:, None]
        fits = np.all(np.abs(counts - steps * np.round(counts / steps)) <= 1.0, axis=1)
        if fits.any():
            return float(steps[np.argmax(fits), 0]) * last_digit
    return last_digit


def _are_all_different(curves: Sequence[Matrix]) -> bool:
    """Return whether no two readings of any curves are at the same place, as where loads are not set to chosen values."""
    places = [place for points in curves for place in points[:, 0].tolist()]
    return len(set(places)) == len(places)


def _sum_residuals(curves: Sequence[Matrix], most: int) -> tuple[float, float]:
    """Return the sum of squares about a polynomial of each curve of at most some degree, and its degrees of freedom."""
    parts = [_residuals_of_polynomial(points[:, 0], points[:, 1], most) for points in curves]
    return float(sum(squares for squares, _ in parts)), float(sum(freedom for _, freedom in parts))


def _residuals_of_polynomial(x: Vector, y: Vector, most: int) -> tuple[float, float]:
    """Return the sum of squares about a polynomial of x of at most some degree, and its degrees of freedom."""
    n_different = len(np.unique(x))
    degree = min(most, n_different - 2 if n_different > 3 else n_different - 1)
    width = np.ptp(x)
    design = np.vander((x - x.min()) / width if width > 0 else np.zeros(len(x)), degree + 1)
    fit = np.linalg.lstsq(design, y, rcond=None)[0]
    return float(np.sum((y - design @ fit) ** 2)), float(len(y) - degree - 1)


@dataclass(frozen=True)
class CoarseReadings:
    """Resolution of a table whose repeated readings are equal to the last digit.

    Args:
        file: Name of the table.
        last_digit: Last digit of its readings, with their unit.
        sd: Standard deviation that it gives a reading, in the same.
        different: Number of readings that do not repeat another.
        log_sd: Standard deviation that the last digit gives the logarithm of a reading, on average of these.
    """

    file: str
    last_digit: str
    sd: float
    different: int
    log_sd: float


def find_coarse_readings(
    file: str, settings: Float[np.ndarray, "rows settings"], read: Vector, unit: str = ""
) -> CoarseReadings | None:
    """Return the resolution of a table whose repeated readings are all alike; None for any other.

    Args:
        file: Name of the table.
        settings: Under what each row was read, but for the mounting; NaN where one is not known.
        read: Readings; those of 0 and below are left out, as they have no logarithm.
        unit: Its unit.
    """
    if not np.all(read > 0):
        return None
    settings = np.nan_to_num(settings, nan=-1.0)
    conditions = np.unique(settings, axis=0)
    different = np.unique(np.column_stack([settings, read]), axis=0)[:, -1]
    if len(different) > len(conditions) or len(read) - len(conditions) < _LEAST_AGAIN:
        return None
    last_digit = find_last_digit(read)
    if last_digit == 0:
        return None
    log_sd = float(np.sqrt(np.mean((last_digit / different) ** 2) / 12))
    return CoarseReadings(file, f"{last_digit:g} {unit}".strip(), last_digit / 12**0.5, len(different), log_sd)


def find_last_digit(values: Vector) -> float:
    """Return the largest power of ten of which all values are multiples; 0 if there is none that a display would show."""
    for power in _POWERS:
        if 10.0**power < NO_NOISE * values.max():
            break
        counts = values / 10.0**power
        if np.all(np.abs(counts - np.round(counts)) < _WHOLE * counts):
            return 10.0**power
    return 0.0
