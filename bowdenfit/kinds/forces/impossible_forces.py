"""Refuse forces that no rope shows: an output that does not follow the input, and rows in which friction adds force.

While a rope slides, what comes out rises with what goes in, whatever its friction does with the load: pulling, it rises at
least in proportion, and returning by at least as many newtons, for the capstan equation as for any load exponent or drag.

A rope gains no force: its log ratio s log(F_in/F_out) is not negative. The p-value of a gain is that of Student's t for a rope
without any friction, with the noise as stated or as the other readings of a run scatter, and Bonferroni's rule divides
`FALSE_ALARM` among all these tests: fewer than one healthy table of a thousand is refused, however many rows it has. Where
every reading has a run of its own, no scatter shows the noise: it is then taken to be 2 % of the force, known as well as from
six readings, together with how readings differ from run to run; a bench that is noisier states its noise.

A row that differs from the others of its run by a factor of two, which no noise of that run explains, is refused as well.
"""

from dataclasses import dataclass, replace
from typing import NoReturn

import numpy as np

from bowdenfit.description import Description
from bowdenfit.errors import DatasetError
from bowdenfit.kinds.forces.table import ForceTable
from bowdenfit.kinds.plausibility import GAIN_ERROR
from bowdenfit.recordings.rope_strokes import OPPOSED
from bowdenfit.types import Flags, Labels, Matrix, Vector
from bowdenfit.words import percent, shown

FALSE_ALARM = 1e-3  # healthy tables that are refused, at most; held by tests/kinds/forces/test_gained_forces.py
_RARER = 1e-3  # factor on FALSE_ALARM for outliers, whose noise need not be normal; a judgement
_FEWEST = 4  # degrees of freedom from which scatter estimates the noise, to about a third: 1 / sqrt(2 * 4)
# Noise of a log ratio where no readings repeat: 2 % in each of two cells, as if known from six readings. A judgement.
_USUAL_NOISE, _USUAL_FREEDOM = 0.02 * np.sqrt(2), 6.0
_TRUNCATED = 1.8  # sd of a normal over that of either half: 1 / sqrt(1 - 2 / pi) = 1.66, and 8 % for estimating it
_LEAST_FOR_LINE = 3  # readings of a cell above which a line with two coefficients leaves some freedom
# An output does not follow the input where its slope is surely below half of a rope's least, and the input explains less than
# a quarter of its variance. Judgements, by which none of 3000 noisy benches is refused (tests/kinds/forces/test_following.py).
_WIDE = 0.3  # standard deviation of the loads of a run over their mean, from which the slope is looked at
_SURE = 3.0  # standard errors of the slope
_SLOPE = 0.5  # share of a rope's least slope
_EXPLAINED = 0.25  # share of the variance of the output
_ZERO_ERROR = 0.005  # error of zero over the largest force where none is stated; a judgement
_SDS = 3.0  # standard deviations of stated errors of the load cells that are allowed: 1 in 370 is beyond
# What follows chooses the words of a refusal, and under Student noise whether a table is refused: judgements.
_MOSTLY = 0.5  # share of the rows of a stroke from which a mistake is the whole table's
_MIXED = 0.2, 0.8  # shares of gaining rows between which a table of one stroke may hold both
_ABOUT = 0.3  # least median loss of the other rows, over the median gain, where both strokes are in a table
_FACTORS = {"lbf and N": 4.4482, "kgf and N": 9.80665, "kN and N (or N and mN)": 1000.0}  # units mistaken for each other
_LEAST, _MOST = 0.15, 1.02  # efficiencies that a cable may have once the unit is right
_NO_SWAP = 2.5  # output over input above which a unit is likelier than swapped columns of a cable below 40 %
_SLIGHT = 0.1  # log gain of force that load cells may differ by
# A row is impossible by itself, however few others show the noise, where its forces differ by this factor and by this share of
# the table's largest force. Calculation: log(2.5) is six standard deviations of cells with a noise of a tenth of the load.
_ANY_GAIN, _LARGE_GAIN = 2.5, 0.1
_OTHER_RATIO = 0.1  # log ratio about which pull and return may lie by the gains of load cells; a judgement
_ABOUT_UNIT = 0.05  # log ratio within which units explain it; a judgement
_TYPED = "a typing error, a cell that slipped by a row, or a wrong stroke; correct the row or leave it out"
_STROKES = {1: ("pulling", "more"), -1: ("returning", "less")}


@dataclass(frozen=True)
class LogGains:
    """Log ratios by which sliding readings of a force table gain force.

    Args:
        log_gain: Logarithm of what each gains: output over input while pulling, input over output while returning [1].
        load: A load whose error has nothing to do with that, such as the sum of both forces where friction is small [N].
        variances: Relative variances of its input and its output, one column each, for a noise of 1 N [1/N^2]; for the stated
            one where it is stated.
        stroke: 1 while pulling, -1 while returning.
        cell: Number of each reading's run and stroke.
    """

    log_gain: Vector
    load: Vector
    variances: Matrix
    stroke: Labels
    cell: Labels

    @property
    def weight(self) -> Vector:
        """One over the variance of the log gain."""
        return np.asarray(1 / self.variances.sum(axis=1))

    def standardized(self, off: Vector) -> Vector:
        """Return how far off readings are, in noises of 1 N, by residuals of log gains [1], or by newtons if that is more.

        A force that is smaller by a factor of 1000 is hardly known by its logarithm, and far from what the other one says.
        """
        is_output_low = (off < 0) == (self.stroke > 0)
        shrunk = np.where(np.column_stack([~is_output_low, is_output_low]), np.exp(-2 * np.abs(off))[:, None], 1.0)
        in_newtons = -np.expm1(-np.abs(off)) / np.sqrt((self.variances * shrunk).sum(axis=1))
        return np.asarray(np.maximum(np.abs(off) * np.sqrt(self.weight), in_newtons))


def flag_gains(excess: Vector, readings: LogGains, stated: float | None) -> tuple[Flags, Flags]:
    """Flag rows whose gain noise does not explain, and rows of cells, or of the table, whose mean gain it does not.

    Args:
        excess: Gain of each reading beyond what load cells explain [1].
        readings: All sliding readings of a table.
        stated: Noise of a force reading as stated [N], 1 where the weights have it; None where scatter estimates it.
    """
    log_gain, weight, cell = readings.log_gain, readings.weight, readings.cell
    n, total = len(excess), np.bincount(cell, weight)
    limit = FALSE_ALARM / (n + len(total) + 1)
    of_cell = np.bincount(cell, weight * excess) / np.sqrt(total)
    if stated is not None:
        single = _p_value(excess * np.sqrt(weight) / stated, np.full(n, np.inf)) < limit
        return single, (_p_value(of_cell / stated, np.full(len(total), np.inf)) < limit)[cell]
    if n - len(total) < _FEWEST:
        return _flag_gains_without_repeats(excess, log_gain, limit)
    # Where strokes are not marked, a run is split into gains and losses: each half scatters less.
    halves = np.unique(2 * cell + (log_gain > 0), return_inverse=True)[1].ravel()
    single, together = np.zeros(n, dtype=bool), np.zeros(n, dtype=bool)
    for group, factor in ((cell, 1.0), (halves, _TRUNCATED)):
        _, noise, freedom = _residual_scatter(replace(readings, cell=group))
        if np.min(freedom) >= _FEWEST - 1:
            single |= _p_value(excess * np.sqrt(weight) / noise / factor, freedom) < limit
            together |= _p_value(of_cell[cell] / noise / factor, freedom) < limit
    return single, together


def _flag_gains_without_repeats(excess: Vector, log_gain: Vector, limit: float) -> tuple[Flags, Flags]:
    """Flag gains where no readings repeat: their noise is the usual one, together with how the readings differ."""
    n, freedom = len(excess), _USUAL_FREEDOM + len(excess) - 1.0
    known = _USUAL_FREEDOM * _USUAL_NOISE**2
    squares = (log_gain - log_gain.mean()) ** 2
    others = np.sum(squares) - squares * (n / (n - 1.0) if n > 1 else 1.0)
    left = np.full(n, max(freedom - 1, _USUAL_FREEDOM))
    single = _p_value(excess / np.sqrt((known + np.maximum(others, 0.0)) / left), left) < limit
    of_table = excess.mean() * np.sqrt(n * freedom / (known + np.sum(squares)))
    return single, np.full(n, _p_value(np.array([of_table]), np.array([freedom]))[0] < limit)


def flag_outliers(readings: LogGains) -> Flags:
    """Flag readings that lie off the others of their cell by a factor of two and far beyond their noise."""
    if len(readings.cell) - np.max(readings.cell) - 1 < _FEWEST:
        return np.zeros(len(readings.cell), dtype=bool)
    off, noise, freedom = _residual_scatter(readings)
    limit = _RARER * FALSE_ALARM / len(readings.cell)
    return np.asarray((np.abs(off) > np.log(2)) & (_p_value(readings.standardized(off) / noise, freedom) < limit))


def _residual_scatter(readings: LogGains) -> tuple[Vector, Vector, Vector]:
    """Return residuals of each row about a line in one over the load, the noise that all other rows show, and its freedom.

    The line takes what zeros and hidden tension do at low loads out of the noise.
    """
    weight, group = readings.weight, readings.cell
    total = np.bincount(group, weight)

    def from_mean(of: Vector) -> Vector:
        return np.asarray(of - (np.bincount(group, weight * of) / total)[group])

    inverse = 1 / readings.load
    x, deviation = from_mean(inverse), from_mean(readings.log_gain)
    spread = np.bincount(group, weight * x**2)
    sloped = (np.bincount(group) > _LEAST_FOR_LINE) & (spread > 1e-12 * total * np.mean(inverse) ** 2)
    spread = np.where(sloped, spread, np.inf)
    residual = deviation - x * (np.bincount(group, weight * x * deviation) / spread)[group]
    leverage = weight * (1 / total[group] + x**2 / spread[group])
    squares, shared = weight * residual**2, leverage < 1 - 1e-9
    own = np.divide(squares, 1 - leverage, out=np.zeros(len(weight)), where=shared)
    left = np.maximum(len(weight) - len(total) - np.sum(sloped) - shared, 1.0)
    others = np.maximum(np.sum(squares) - own, 1e-24 * np.max(weight))
    return residual, np.sqrt(others / left), left


def _p_value(t: Vector, freedom: Vector) -> Vector:
    """Return the probability of a larger Student's t; of a larger normal deviate where the freedom is infinite."""
    from scipy.special import ndtr, stdtr

    return np.asarray(np.where(np.isinf(freedom), ndtr(-t), stdtr(np.where(np.isinf(freedom), 1.0, freedom), -t)))


def check_following(table: ForceTable) -> None:
    """Refuse a table whose output force does not rise with its input force.

    Raises:
        DatasetError: Says what was seen, the usual causes and what to do.
    """
    for stroke, (how, _) in _STROKES.items():
        rows = np.flatnonzero(table.stroke == stroke)
        if _does_not_follow(table, rows, stroke):
            force_in, force_out = table.input_force[rows], table.output_force[rows]
            opposed = np.ptp(force_out) > 0 and np.corrcoef(force_in, force_out)[0, 1] < OPPOSED
            how_much = "falls where the input rises" if opposed else "barely depends on it"
            cause = "the two tensions of a pull-pull pair" if opposed else "a dead load cell"
            raise DatasetError(
                f"{table.origin.describe_row(rows[0])} and on: while {how}, output_force does not follow input_force, "
                f"which goes from {force_in.min():.4g} to {force_in.max():.4g} N while the output is "
                f"{force_out.mean():.4g} N ± {force_out.std():.2g} N, and {how_much}; a rope transmits more force "
                f"where more goes in. The usual causes are {cause}, a column that is no force (a position, a time), and rows "
                "of one column that belong beside others of the other; map the right columns in cable.toml, or leave these "
                "rows out."
            )


def _does_not_follow(table: ForceTable, rows: np.ndarray, stroke: int) -> bool:
    """Return whether the output of a stroke's rows depends on the input by far less than a rope's, run by run."""
    force_in, force_out = table.input_force[rows], table.output_force[rows]
    settings = np.column_stack([table.run[rows], np.nan_to_num(table.route[rows])])
    cell = np.unique(settings, axis=0, return_inverse=True)[1].ravel()
    count = np.bincount(cell)
    mean_in, mean_out = ((np.bincount(cell, force) / count)[cell] for force in (force_in, force_out))
    x, y = force_in / mean_in - 1, (force_out - mean_out) / (mean_out if stroke > 0 else mean_in)
    freedom, spread = len(rows) - len(count) - 1, float(x @ x)
    if freedom < _FEWEST or spread < len(rows) * _WIDE**2:
        return False
    slope, whole = float(x @ y) / spread, float(y @ y)
    unexplained = max(whole - slope**2 * spread, 0.0)
    explained = 1 - unexplained / whole if whole > 0 else 0.0
    return (explained < _EXPLAINED or slope < 0) and slope + _SURE * np.sqrt(unexplained / freedom / spread) < _SLOPE


@dataclass(frozen=True)
class ForceGains:
    """Rows in which a rope would have gained force.

    Args:
        rows: Numbers of the sliding rows in the table.
        stroke: Stroke of each.
        log_gain: Logarithm of what each gained [1].
        excess: The same beyond what errors of the load cells explain; not positive where nothing is wrong.
        beyond_noise: Which rows noise does not explain, each by itself.
        together: Which belong to a run and stroke whose mean noise does not explain, or to such a table.
    """

    rows: Labels
    stroke: Labels
    log_gain: Vector
    excess: Vector
    beyond_noise: Flags
    together: Flags

    def share(self, stroke: int) -> float:
        """Return the share of the rows of a stroke that gain force; 0 without any."""
        on_stroke = self.stroke == stroke
        return float(np.mean(self.excess[on_stroke] > 0)) if on_stroke.any() else 0.0

    @property
    def mixed(self) -> bool:
        """Whether a table of one stroke seems to hold both: some rows gain about what the others lose."""
        up = self.excess > 0
        if len(np.unique(self.stroke)) > 1 or not _MIXED[0] < np.mean(up) < _MIXED[1]:
            return False
        return bool(-np.median(self.log_gain[~up]) > _ABOUT * np.median(self.log_gain[up]))

    @property
    def center(self) -> float:
        """Log ratio of output to input about which pulls and returns lie, which is 0 of a rope; NaN of one stroke alone."""
        pull, back = self.stroke == 1, self.stroke == -1
        if not (pull.any() and back.any()):
            return float("nan")
        return float(np.median(self.log_gain[pull]) - np.median(self.log_gain[back])) / 2

    @property
    def wide(self) -> bool:
        """Whether the mistake concerns the whole table."""
        return self.mixed or max(self.share(1), self.share(-1)) > _MOSTLY


def check_gains(table: ForceTable, description: Description) -> None:
    """Refuse a table in which friction would add force, or a row stands out of its run by far.

    Where noise = "student" says that some readings are grossly wrong, only a mistake of the whole table is refused.

    Raises:
        DatasetError: Says where, the usual cause and what to do.
    """
    if not np.any(table.stroke):
        return
    gains, heavy = find_gains(table, description), description.noise == "student"
    if gains is not None and (gains.beyond_noise.any() or gains.together.any()) and (gains.wide or not heavy):
        _refuse_gains(table, gains)
    rows, readings = _log_gains(table, description)
    if not heavy and (out := flag_outliers(readings)).any():
        row = int(rows[np.argmax(out)])
        raise DatasetError(
            f"{table.origin.describe_row(row)}: output_force {table.output_force[row]:.4g} N at input_force "
            f"{table.input_force[row]:.4g} N is off the other readings of its run and stroke by a factor of more than two, "
            f"which noise rarely does: the usual cause is {_TYPED}."
        )


def find_gains(table: ForceTable, description: Description) -> ForceGains | None:
    """Find gains of force beyond what errors of the load cells explain; None where there are none."""
    rows, readings = _log_gains(table, description)
    excess = readings.log_gain - _allowed_gain(table.input_force[rows], table.output_force[rows], description)
    if not np.any(excess > 0):
        return None
    stated = description.sensors.largest_force_noise if table.sd is None else 1.0
    single, together = flag_gains(excess, readings, stated)
    force_in, force_out = table.input_force[rows], table.output_force[rows]
    large = np.abs(force_out - force_in) > _LARGE_GAIN * max(force_in.max(), force_out.max())
    single |= (excess > np.log(_ANY_GAIN)) & large
    return ForceGains(rows, table.stroke[rows], readings.log_gain, excess, single & (excess > 0), together & (excess > 0))


def _log_gains(table: ForceTable, description: Description) -> tuple[Labels, LogGains]:
    """Return the numbers of the sliding rows, and what each gains."""
    rows = np.flatnonzero(table.stroke != 0)
    force_in, force_out, stroke = table.input_force[rows], table.output_force[rows], table.stroke[rows]
    noises = table.noises(description.sensors.noise_ratio)[rows]
    variances = (noises / np.column_stack([force_in, force_out])) ** 2
    cell = np.unique(np.column_stack([table.run[rows], stroke]), axis=0, return_inverse=True)[1].ravel()
    return rows, LogGains(-stroke * np.log(force_in / force_out), force_in + force_out, variances, stroke, cell)


def _allowed_gain(force_in: Vector, force_out: Vector, description: Description) -> Vector:
    """Return what errors of gain and zero of the load cells may add to each log ratio [1]."""
    sensors, largest = description.sensors, max(force_in.max(), force_out.max())
    # No cell is made for more than its rope may have, whatever a wrong unit makes of the other.
    zero_in, zero_out = (_ZERO_ERROR * min(largest, force.max() / _LEAST) for force in (force_in, force_out))
    of_gain = GAIN_ERROR if description.gain_sd is None else _SDS * description.gain_sd
    if sensors.offset_sd is not None:
        zero_in = zero_out = _SDS * sensors.offset_sd.to("force")
    return np.asarray(of_gain + np.hypot(zero_in / force_in, zero_out / force_out))


def _refuse_gains(table: ForceTable, gains: ForceGains) -> NoReturn:
    is_single = gains.beyond_noise.any() and not gains.wide
    wrong = gains.beyond_noise if is_single else gains.beyond_noise | gains.together
    i = int(np.argmax(np.where(wrong, gains.excess, -np.inf)))
    row, (how, what) = int(gains.rows[i]), _STROKES[int(gains.stroke[i])]
    force_in, force_out = table.input_force[row], table.output_force[row]
    many = f"{int(np.sum(gains.excess > 0))} of {len(gains.rows)}"
    cause = _describe_cause_of_table(gains) if gains.wide else _describe_cause_of_row(table, gains, row)
    raise DatasetError(
        f"{table.origin.describe_row(row)}: output_force {force_out:.4g} N at input_force {force_in:.4g} N, "
        f"{percent(force_out / force_in, 0)} while {how}; friction never lets {what} out than in, and noise rarely looks "
        f"like it. {many} rows show it: the usual cause is {cause}."
    )


def _describe_cause_of_table(gains: ForceGains) -> str:
    """Return the usual cause of a mistake in a whole table, by which strokes show it, and its remedy."""
    strokes = [stroke for stroke in (1, -1) if np.any(gains.stroke == stroke)]
    wrong = [stroke for stroke in strokes if gains.share(stroke) > _MOSTLY]
    if wrong != strokes and abs(gains.center) > _OTHER_RATIO:
        return _describe_other_ratio(gains.center)
    units = _find_mistaken_units(gains, wrong[0]) if wrong else ""
    if units and (len(strokes) == 1 or wrong != strokes):
        return f"the unit in one heading, {units} mistaken; correct the heading"
    if gains.mixed:
        return "rows in which the rope slides back and that are not marked so; add a column stroke with pull and return"
    if wrong == strokes:
        also = " or pull and return" if len(strokes) > 1 else ""
        other = "" if len(strokes) > 1 else ", a load cell that was not zeroed, or a lever or pulley before one"
        remedy = "" if len(strokes) > 1 else "; a lever's or pulley's ratio is stated as sensors.output_ratio"
        return (
            f"that the columns input_force and output_force{also} are swapped{other}; correct the headings, or map them in "
            f'cable.toml: columns = {{ input_force = {{ name = "..." }} }}{remedy}'
        )
    return (
        "the unit, gain or zero of one load cell, or a wrong stroke; correct the table, or state [sensors] offset_sd, or "
        "input_gain_error_sd and output_gain_error_sd"
    )


def _describe_other_ratio(center: float) -> str:
    """Return the usual cause where pull and return lie about another ratio than 1, and its remedy.

    Args:
        center: Log ratio of output to input about which they lie [1].
    """
    seen = f"because pull and return lie about an output of {np.exp(center):.2g} times the input"
    units = [units for units, factor in _FACTORS.items() if abs(abs(center) - np.log(factor)) < _ABOUT_UNIT]
    if units:
        return f"the unit in one heading, {units[0]} mistaken, {seen}; correct the heading"
    return (
        f"a lever, a pulley or a drum between rope and load cell, or a wrong unit, {seen}; correct the unit, or state the "
        f"exact force on the rope over the reading of its cell, as by --set sensors.output_ratio={np.exp(-center):.3g}"
    )


def _find_mistaken_units(gains: ForceGains, stroke: int) -> str:
    """Return the units that would make a table's efficiencies possible, in words; empty if none would."""
    ratio = float(np.exp(np.median(gains.log_gain[gains.stroke == stroke])))
    if ratio < _NO_SWAP:
        return ""
    return " or ".join(units for units, factor in _FACTORS.items() if _LEAST < ratio / factor < _MOST)


def _describe_cause_of_row(table: ForceTable, gains: ForceGains, row: int) -> str:
    """Return the usual cause where most of the table is sound, and its remedy."""
    same = (table.run[gains.rows] == table.run[row]) & (gains.stroke == table.stroke[row])
    if np.sum(same) > 1 and np.mean(gains.excess[same] > 0) > _MOSTLY:
        name = shown(table.run_names[table.run[row]])
        if np.max(gains.log_gain[same]) < _SLIGHT:
            return (
                f"load cells that differ in gain, which shows first where the cable bends least, as in the run {name}, or one "
                "that was not zeroed; state input_gain_error_sd and output_gain_error_sd under [sensors], or correct the run"
            )
        return (
            f"that columns, strokes or units of the run {name} differ from the others', or that a "
            "load cell was not zeroed; correct it, or leave the run out"
        )
    return f'{_TYPED}, or state a larger noise, [sensors] force_noise = {{ value = ..., unit = "N" }}'
