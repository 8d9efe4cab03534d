"""What the model does not describe, in sentences with a remedy: readings that depend on where, when or how they were taken."""


from collections.abc import Sequence

from bowdenfit.cable.load_cells import DELAY_ERROR
from bowdenfit.cable.registry import CURVES
from bowdenfit.description import BY_GROUP
from bowdenfit.inference.departure import FALSE_ALARM, Departure
from bowdenfit.kinds import reading_called, readings_called
from bowdenfit.kinds.sliding_rows import ORDER, SPEED, STROKE, ZERO
from bowdenfit.kinds.term import GROUP, LOAD, WRAP_ANGLE
from bowdenfit.parameters.priors import Normal
from bowdenfit.questions.check.answer import Checks, checks_of
from bowdenfit.results.record import Record, cached_per_fit
from bowdenfit.words import few, listed, significant

_FEW = 3  # departures that are said
_INTERVAL = 0.9
_FAR_LATE = 6.0  # standard errors of a delay, which are right to a third


@cached_per_fit
def say_what_is_not_described(fit: Record) -> tuple[str, ...]:
    """Sentences about readings that the model does not describe, the clearest first; none where all is chance."""
    clear = [each for each in fit.least_squares.departures if each.is_noticeable]
    told: dict[tuple[str, str], Departure] = {}
    for each in clear:  # the same place may have been asked about in two ways, and inside runs as well as between them
        told.setdefault((each.table, each.group or each.against), each)
    found = checks_of(fit)
    sentences = tuple(_sentence(fit, each) for each in list(told.values())[:_FEW])
    noise = fit.dataset.description.noise
    return sentences + _late(fit) + _far_out(fit, noise) + (_scatter(found, noise) if found else ())


def _late(fit: Record) -> tuple[str, ...]:
    """A delay of the output channel that sliding wants far from where the reversals put it.

    Friction and delay are told apart by how fast the force changes, and so is much that is neither.
    """
    late = next((p for p in fit.model.space.free if p.name == DELAY_ERROR), None)
    if late is None or not isinstance(late.prior, Normal):
        return ()
    by_least_squares = fit.sampled is None
    off = fit.least_squares.estimates[late.name].value if by_least_squares else fit.parameter(late.name).median
    sds = abs(off) / late.shown_scale / float(late.prior.sd)
    if sds < _FAR_LATE:
        return ()
    return (
        f"While the rope slides, the output seems {abs(off):.2g} ms {'later' if off > 0 else 'earlier'} than it was taken to "
        f"be, {sds:.0f} standard errors of that: something else changes the loss with how fast the force changes, such as "
        "noise of a cell that stays alike for long, a filter, or friction that depends on speed. State the delay if it is "
        'known (delay = { value = 10, unit = "ms" } under prepare in cable.toml), record with less noise, or compare with '
        "--friction rate-dependent.",
    )


def _far_out(fit: Record, noise: str) -> tuple[str, ...]:
    """Readings far out of least squares, where nothing was sampled; draws judge them better."""
    far = fit.least_squares.far_readings
    if not far or fit.sampled is not None or noise == "student":
        return ()
    return (_far_sentence([reading_called(each.table, each.label) for each in far]),)


def _far_sentence(names: Sequence[str]) -> str:
    return (
        f"The model does not describe {few(names, _FEW)}: so far out that chance does it in less than one healthy "
        f"fit of {1 / FALSE_ALARM:.0f}. Look at how it was measured and written down; if it stays, fit with --noise student, "
        "or leave it out and say so."
    )


def _sentence(fit: Record, found: Departure) -> str:
    """'The model does not describe ...: the loss is 12 % larger ... What to do.'"""
    if found.against == ZERO:
        return _drift(found)
    readings = readings_called(found.table)
    what = _called(found.group) if found.group else readings.words
    read = "the loss" if readings.are_efficiencies else "what was read"
    low, high = (_much(each) for each in (found.at_low, found.at_high))
    where = _ends(found, fit.model.cable.friction.conditions.groups)
    return (
        f"The model does not describe {what}: {where[0]} {read} is {low} than the model says, and {where[1]} {high}; chance "
        f"does as much in {_odds(found.p_value)}. {_remedy(fit, found)}"
    )


def _drift(found: Departure) -> str:
    """Of a zero that drifts."""
    far = significant(found.moved or 0.0, 2)
    return (
        f"The model does not describe {readings_called(found.table).words}: the zero of the output drifts, by about "
        f"{significant(abs(found.high - found.low), 2)} N from the start of a recording to its end (or that of the input, the "
        f"other way), which moves a coefficient by {far} of the half width of its interval; chance "
        f"does as much in {_odds(found.p_value)}. Let the load cells warm up and tare before each recording; leave out the "
        "part in which the zero moves."
    )


def _called(column: str) -> str:
    return column.replace("_", " ")


def _much(excess: float) -> str:
    """'12 % larger'"""
    return f"{significant(100 * abs(excess), 2)} % {'larger' if excess >= 0 else 'smaller'}"


def _odds(chance: float) -> str:
    """'one healthy fit of 5,000'"""
    if chance < 1e-6:
        return "less than one healthy fit of a million"
    return f"one healthy fit of {float(f'{1 / chance:.1g}'):,.0f}"


def _ends(found: Departure, groups: Sequence[str]) -> tuple[str, str]:
    """Where the lowest and the highest third were taken."""
    if found.against == GROUP:
        low, high = (groups[round(number) - 1] for number in (found.low, found.high))
        return f"in the group {low}", f"in the group {high}"
    if found.against == STROKE:
        return ("on the return", "on the pull") if found.inside else ("on the way there", "on the way back")
    if found.against == ORDER:
        return "in the first third of the readings", "in the last third"
    name, _, unit = found.against.rstrip(")").partition(" (")
    low, high = (f"{float(f'{value:.3g}'):g}{f' {unit}' if unit else ''}" for value in (found.low, found.high))
    return f"around a {name.lower()} of {low}", f"around {high}"


def _remedy(fit: Record, found: Departure) -> str:
    """What to do about it."""
    model, losses = fit.dataset.description.friction_model, readings_called(found.table).are_efficiencies
    if found.group:
        return _other_curve(fit, found.group)
    if found.against == LOAD and losses:
        zero = "the zero of the load cells (tare them with the rope slack, or have their offsets fitted)"
        return _other_friction(model, ("drag", "load-dependent"), zero)
    if found.against == SPEED and losses:
        return _other_friction(model, ("rate-dependent",), "the delay between the channels")
    if found.against == STROKE and losses:
        return _other_friction(model, ("stroke-dependent",), "the zero and the gain of both load cells")
    if found.against == GROUP:
        return _other_friction(model, (BY_GROUP,), "what else is not the same in these groups")
    if found.against == WRAP_ANGLE and losses:
        return (
            "Friction alone grows with the bend from nothing: the usual causes are a bend that nobody measured, at the ends of "
            "the sheath or between them (a [[contact]] of its own), angles that were read from another zero, and load cells "
            "that differ in gain (state input_gain_error_sd and output_gain_error_sd under [sensors]). A run with the cable "
            "as straight as it gets tells most."
        )
    if found.against == ORDER:
        return (
            "Something drifted while it was measured: temperature, wear, or the zero of a load cell. Tare before each run, "
            "take loads and bends in random order, and leave out the readings from before it settled."
        )
    return "Look at those readings first; if they are right, this model is not that of the cable there."


def _other_friction(model: str, options: tuple[str, ...], otherwise: str) -> str:
    """The friction options that are not in the model yet."""
    missing = [option for option in options if option not in model]
    if not missing:
        return f"The friction model has {model} already, so look at {otherwise}."
    asked = " or ".join(f"--friction {option}" for option in missing)
    return f"Fit again with {asked} (bowdenfit compare tells which), and look at {otherwise}."


def _other_curve(fit: Record, column: str) -> str:
    """The curve families that the angles of a column do fit."""
    from bowdenfit.questions.check.other_curves import follows  # what loads JAX is loaded where it is needed

    contacts = fit.dataset.description.contact
    number, contact = next((i, c) for i, c in enumerate(contacts) if c.wrap_angle.column == column)
    fitting = [name for name in CURVES if name != contact.wrap_angle.curve and follows(fit.dataset, number, name)]
    if fitting:
        asked = " or ".join(f"--set contact.{number}.wrap_angle.curve={name}" for name in fitting)
        return f"A {contact.wrap_angle.curve} curve does not follow these angles; fit again with {asked}."
    others = listed([name for name in CURVES if name != contact.wrap_angle.curve])
    return (
        f"Neither a {contact.wrap_angle.curve} curve nor any other family ({others}) follows these angles; narrow "
        "the range under [route] to where one does, or measure the angle with each run."
    )


def _scatter(found: Checks, noise: str) -> tuple[str, ...]:
    """Readings that lie outside what the fit says of them more often, or farther, than chance does.

    With Student noise a few readings may lie anywhere, which is what it is for.
    """
    from scipy.special import bdtrc

    sentences = []
    for table in found.tables:
        outside = table.measured - table.in_interval
        if outside and bdtrc(outside - 1, table.measured, 1 - _INTERVAL) * len(found.tables) < FALSE_ALARM:
            sentences.append(
                f"The model does not describe {readings_called(table.table).words}: {outside} of {table.measured} lie outside "
                "their 90 % intervals. The usual causes are a unit or a column that is not what its heading says, labels of "
                "runs that belong to several mountings, and noise that was stated too small."
            )
    among = len(found.readings)
    far = [r for r in found.outliers if r.chance * among < FALSE_ALARM]
    if far and noise == "normal":
        sentences.append(_far_sentence([reading_called(r.table, r.label) for r in far]))
    return tuple(sentences)
