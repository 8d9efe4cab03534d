"""Lack of fit in sentences with a remedy: residuals that depend on where, when or how readings were taken.

Where a curve does not follow the wrap angles, the other curve families are tried.
"""

import shlex
from collections.abc import Sequence

from scipy.special import bdtrc

from bowdenfit.cable.registry import CURVES
from bowdenfit.cable.sensors import DELAY_ERROR
from bowdenfit.dataset import Dataset
from bowdenfit.description import BY_GROUP
from bowdenfit.inference.lack_of_fit import FALSE_ALARM, Departure
from bowdenfit.kinds import describe_reading, find_readings
from bowdenfit.kinds.forces.table import ForceTable
from bowdenfit.kinds.sliding_rows import OFFSET, ORDER, SPEED, STROKE, ZERO
from bowdenfit.kinds.tables import AngleTable, Measurements
from bowdenfit.kinds.term import GROUP, LOAD, WRAP_ANGLE
from bowdenfit.parameters.priors import Normal
from bowdenfit.questions.check.answer import Checks, check_readings
from bowdenfit.questions.check.remedies import describe_remedies, fit_anew
from bowdenfit.questions.recorded.causes_of_departures import describe_creep, describe_slow_noise
from bowdenfit.results.record import Record, cached_per_fit
from bowdenfit.words import few, listed, shown, significant

_MAX_NAMED = 3  # departures, or readings, that are named
_INTERVAL = 0.9  # probability of the intervals that readings are counted in
_MAX_DELAY_ERRORS = 6.0  # standard errors of a delay; a judgement, as these errors are right to a third


@cached_per_fit
def describe_lack_of_fit(fit: Record) -> tuple[str, ...]:
    """Describe readings that the model does not describe, the clearest first; no sentences where all is chance."""
    clear = [departure for departure in fit.least_squares.departures if departure.is_noticeable]
    departures: dict[tuple[str, str], Departure] = {}
    for departure in clear:  # one place may have been tested in two ways, and inside runs as well as between them
        departures.setdefault((departure.table, departure.group or departure.against), departure)
    checks = check_readings(fit)
    of_losses = [departure for departure in departures.values() if _is_of_losses(departure)]
    explained = next((departure for departure in of_losses if _describe_recorded_cause(fit, departure)), None)
    if explained is None and of_losses and describe_remedies(fit):
        explained = of_losses[0]
    if explained is not None:  # by what makes losses depart in the other ways too
        departures = {key: d for key, d in departures.items() if d is explained or d not in of_losses}
    sentences = tuple(_describe_departure(fit, departure) for departure in list(departures.values())[:_MAX_NAMED])
    noise = fit.dataset.description.noise
    return (
        sentences
        + _describe_delay(fit)
        + _describe_far_readings(fit, noise)
        + (_describe_scatter(checks, noise) if checks else ())
    )


def _is_of_losses(departure: Departure) -> bool:
    """Return whether losses of force depart by what a zero, a gain, drag, the load or the speed changes."""
    is_loss = find_readings(departure.table).are_efficiencies and not departure.group
    return is_loss and departure.against in (WRAP_ANGLE, ORDER, LOAD, STROKE, SPEED, OFFSET)


def _describe_delay(fit: Record) -> tuple[str, ...]:
    """Describe a delay of the output channel that sliding puts far from where the reversals put it.

    Friction and delay are told apart by how fast the force changes, and so is much that is neither.
    """
    delay = next((p for p in fit.model.space.free if p.name == DELAY_ERROR), None)
    if delay is None or not isinstance(delay.prior, Normal):
        return ()
    by_least_squares = fit.sampled is None
    off = fit.least_squares.estimates[delay.name].value if by_least_squares else fit.parameter_of_draws(delay.name).median
    sds = abs(off) / delay.shown_scale / float(delay.prior.sd)
    if not sds >= _MAX_DELAY_ERRORS:  # nor where it is not determined
        return ()
    return (
        f"While the rope slides, the output seems {abs(off):.2g} ms {'later' if off > 0 else 'earlier'} than it was taken to "
        f"be, {sds:.0f} standard errors of that: something else changes the loss with how fast the force changes, such as "
        "noise of a cell that stays alike for long, a filter, or friction that depends on speed. State the delay if it is "
        'known (delay = { value = 10, unit = "ms" } under prepare in cable.toml), record with less noise, or compare with '
        "--friction rate-dependent.",
    )


def _describe_far_readings(fit: Record, noise: str) -> tuple[str, ...]:
    """Describe readings far out of least squares, where nothing was sampled; draws judge them better."""
    far = fit.least_squares.far_readings
    if not far or fit.sampled is not None or noise == "student":
        return ()
    return (_far_reading_sentence([describe_reading(reading.table, reading.label) for reading in far]),)


def _far_reading_sentence(names: Sequence[str]) -> str:
    """Return the sentence about readings far outside what chance does."""
    was, stands, them = ("it was", "it stands", "it") if len(names) == 1 else ("they were", "they stand", "them")
    return (
        f"The model does not describe {few(names, _MAX_NAMED)}: chance alone deviates as much in fewer than one "
        f"healthy fit in {1 / FALSE_ALARM:.0f}. Check how {was} measured and written down; if {stands}, fit with --noise "
        f"student, or leave {them} out and say so."
    )


def _describe_departure(fit: Record, departure: Departure) -> str:
    """Return such as 'The model does not describe ...: the loss is 12 % larger ... What to do.'"""
    if departure.against == ZERO:
        return _describe_drift(departure)
    readings = find_readings(departure.table)
    what = _readable_column(departure.group) if departure.group else readings.words
    read = "the loss" if readings.are_efficiencies else "what was read"
    if departure.against == OFFSET:
        return (
            f"The model does not describe {what}: pulling and returning differ by what an output adds whose zero is off by "
            f"about {significant(departure.high, 2)} N (or an input, the other way); chance alone does this in "
            f"{_odds(departure.p_value)}. {_suggest_remedy(fit, departure)}"
        )
    low, high = (_percent_excess(excess) for excess in (departure.at_low, departure.at_high))
    where = _where_low_and_high(departure, _levels(fit, departure))
    return (
        f"The model does not describe {what}: {where[0]} {read} is {low} than the model says, and {where[1]} {high}; "
        f"chance alone does this in {_odds(departure.p_value)}. {_suggest_remedy(fit, departure)}"
    )


def _describe_drift(departure: Departure) -> str:
    """Describe a zero that drifts."""
    far = significant(departure.moved or 0.0, 2)
    return (
        f"The model does not describe {find_readings(departure.table).words}: the zero of the output drifts, by about "
        f"{significant(abs(departure.high - departure.low), 2)} N from the start of a recording to its end (or that of the "
        f"input, the other way), which moves a coefficient by {far} of the half width of its interval; "
        f"chance alone does this in {_odds(departure.p_value)}. Let the load cells warm up and tare before each recording; "
        "leave out the part in which the zero moves."
    )


def _readable_column(column: str) -> str:
    """Return the name of a column as words."""
    return column.replace("_", " ")


def _percent_excess(excess: float) -> str:
    """Return such as '12 % larger'."""
    return f"{significant(100 * abs(excess), 2)} % {'larger' if excess >= 0 else 'smaller'}"


def _odds(p_value: float) -> str:
    """Return such as 'one healthy fit in 5,000'."""
    if p_value < 1e-6:
        return "fewer than one healthy fit in a million"
    return f"one healthy fit in {float(f'{1 / p_value:.1g}'):,.0f}"


def _levels(fit: Record, departure: Departure) -> Sequence[str]:
    """Return the names of the groups or of the texts in a column that a departure goes by; empty where it goes by numbers."""
    if departure.against == GROUP:
        return fit.model.cable.friction.conditions.groups
    column = fit.model.covariates[departure.table].unused.get(departure.against)
    return column.levels if column is not None else ()


def _where_low_and_high(departure: Departure, levels: Sequence[str]) -> tuple[str, str]:
    """Describe where the lowest and the highest third of the readings were taken."""
    if departure.against == GROUP:
        low, high = (levels[round(number) - 1] for number in (departure.low, departure.high))
        return f"in the group {low}", f"in the group {high}"
    if levels:
        low, high = (levels[round(number)] or "blank" for number in (departure.low, departure.high))
        return f"where {shown(departure.against)} is {shown(low)}", f"where it is {shown(high)}"
    if departure.against == STROKE:
        return ("on the return", "on the pull") if departure.inside else ("on the way there", "on the way back")
    if departure.against == ORDER:
        return "in the first third of the readings", "in the last third"
    name, _, unit = departure.against.rstrip(")").partition(" (")
    low, high = (f"{float(f'{value:.3g}'):g}{f' {unit}' if unit else ''}" for value in (departure.low, departure.high))
    return f"around a {name[:1].lower()}{name[1:]} of {low}", f"around {high}"


def _suggest_remedy(fit: Record, departure: Departure) -> str:
    """Suggest what to do about a departure."""
    model, losses = fit.dataset.description.friction_model, find_readings(departure.table).are_efficiencies
    if departure.group:
        return _suggest_curve(fit, departure.group)
    if cause := _describe_recorded_cause(fit, departure):
        return cause
    if _is_of_losses(departure) and (remedies := describe_remedies(fit)):
        return remedies
    if departure.against == LOAD and losses:
        zero = "the zero of the load cells (tare them with the rope slack, or have their offsets fitted)"
        return _suggest_friction(model, ("drag", "load-dependent"), zero)
    if departure.against == OFFSET:
        return "Tare the load cells with the rope slack, or state how far their zeros may be off (offset_sd under [sensors])."
    if departure.against == SPEED and losses:
        return _suggest_friction(model, ("rate-dependent",), "the delay between the channels")
    if departure.against == STROKE and losses:
        return (
            "A load cell with a wrong gain looks the same: calibrate the cells, or let the fit find the gain, as by --set "
            "sensors.input_gain_error_sd=0.1 --set sensors.output_gain_error_sd=0.1. "
            + _suggest_friction(model, ("stroke-dependent",), "the zero and the gain of both load cells")
        )
    if departure.against == GROUP:
        return _suggest_friction(model, (BY_GROUP,), "what else is not the same in these groups")
    if departure.against == WRAP_ANGLE and losses:
        return (
            "Friction alone grows with the bend from nothing: the usual causes are a bend that nobody measured, at the ends of "
            "the sheath or between them (a [[contact]] of its own), angles that were read from another zero, and load cells "
            "that differ in gain (state input_gain_error_sd and output_gain_error_sd under [sensors]). A run with the cable "
            "as straight as it gets is the most informative."
        )
    if departure.against in fit.model.covariates[departure.table].unused:
        return _suggest_column(fit, departure)
    if departure.against == ORDER:
        return (
            "Something drifted while it was measured: temperature, wear, or the zero of a load cell. Tare before each run, "
            "take loads and bends in random order, and leave out the readings from before it settled."
        )
    return "Look at those readings first; if they are right, this model is not that of the cable there."


def _describe_recorded_cause(fit: Record, departure: Departure) -> str:
    """Describe noise or creep in recordings that changes losses with the load, or with the stroke; empty without."""
    noise = describe_slow_noise(fit, departure) if departure.against == LOAD else ""
    return noise or (describe_creep(fit, departure) if departure.against in (LOAD, STROKE, OFFSET) else "")


def _suggest_column(fit: Record, departure: Departure) -> str:
    """Suggest what an unused column may be that explains the residuals."""
    column, heading = fit.model.covariates[departure.table].unused[departure.against], departure.against
    if column.levels and fit.dataset.measurements.table(ForceTable) is not None:
        name = shlex.quote(f"group={heading}")
        return (
            f"The fit does not use the column {shown(heading)}. For a coefficient of each: --column {name} --friction "
            f"{BY_GROUP}; if it says which readings are bad, leave these out."
        )
    return (
        f"The fit does not use the column {shown(heading)}. If it is the wrap angle, the length or the mounting, say so "
        "(--column in the help of fit, or columns in cable.toml); else friction depends on what this model lacks: fit the "
        "readings by parts, in each of which it is the same."
    )


def _suggest_friction(model: str, options: tuple[str, ...], otherwise: str) -> str:
    """Suggest the friction options that are not in the model yet."""
    missing = [option for option in options if option not in model]
    if not missing:
        return f"The friction model has {model} already, so look at {otherwise}."
    flags = " or ".join(f"--friction {option}" for option in missing)
    return f"Fit again with {flags} (bowdenfit compare says which), and look at {otherwise}."


def _suggest_curve(fit: Record, column: str) -> str:
    """Suggest the curve families that do fit the angles of a column."""
    contacts = fit.dataset.description.contact
    number, contact = next((i, c) for i, c in enumerate(contacts) if c.wrap_angle.column == column)
    family, smooth = contact.wrap_angle.curve, f"--set contact.{number}.wrap_angle.departure=smooth"
    has_family = contact.wrap_angle.departure is not None  # a smooth curve has none to depart from
    families = [name for name in CURVES if name != family and not (has_family and name == "smooth")]
    fitting = [name for name in families if curve_family_fits(fit.dataset, number, name)]
    departs = fit.dataset.description.departs(contact.wrap_angle)
    if fitting:
        flags = " or ".join(f"--set contact.{number}.wrap_angle.curve={name}" for name in fitting)
        otherwise = "" if departs else f", or with {smooth} if the route has no known curve"
        return f"A {family} curve does not follow these angles and forces; fit again with {flags}{otherwise}."
    if departs:
        return (
            f"These angles depart from a {family} curve, and not smoothly either; narrow the range under [route] to where they "
            "do, or measure the angle with each run."
        )
    return (
        f"Neither a {family} curve nor any other family ({listed(families)}) follows these angles; fit again with {smooth}, "
        "narrow the range under [route], or measure the angle with each run."
    )


def _describe_scatter(checks: Checks, noise: str) -> tuple[str, ...]:
    """Describe readings that lie outside their intervals more often, or farther, than by chance.

    With Student noise a few readings may lie anywhere, which is what it is for.
    """
    sentences = []
    for table in checks.tables:
        outside = table.measured - table.in_interval
        if outside and bdtrc(outside - 1, table.measured, 1 - _INTERVAL) * len(checks.tables) < FALSE_ALARM:
            sentences.append(
                f"The model does not describe {table.words}: {outside} of {table.measured} lie outside "
                "their 90 % intervals. The usual causes are a unit or a column that is not what its heading says, labels of "
                "runs that belong to several mountings, and noise that was stated too small."
            )
    n_readings = len(checks.readings)
    far = [r for r in checks.outliers if r.p_value * n_readings < FALSE_ALARM]
    if far and noise == "normal":
        sentences.append(_far_reading_sentence([describe_reading(r.table, r.label) for r in far]))
    return tuple(sentences)


def curve_family_fits(dataset: Dataset, number: int, family: str) -> bool:
    """Return whether curves of another family follow the angles of a contact.

    Args:
        dataset: The data set.
        number: Number of the contact, from 0.
        family: The other family.
    """
    description = dataset.description
    contacts = list(description.contact)
    angle = contacts[number].wrap_angle
    contacts[number] = contacts[number].model_copy(update={"wrap_angle": angle.model_copy(update={"curve": family})})
    changed = description.model_copy(update={"contact": tuple(contacts)})
    table = dataset.measurements.table(AngleTable)
    solved, _ = fit_anew(Dataset(changed, Measurements((table,) if table else (), ()), {}))
    departures = [departure for departure in solved.departures if departure.group == angle.column]
    return bool(departures) and all(departure.p_value >= FALSE_ALARM for departure in departures)
