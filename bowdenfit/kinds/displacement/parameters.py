"""What force at the motor against displacement asks for: the far end, the rope, where there is no force, how it scatters."""

import numpy as np

from bowdenfit.cable.load_cells import INPUT_OFFSET
from bowdenfit.kinds.displacement.arrays import zero_names
from bowdenfit.kinds.displacement.table import DisplacementSettings, DisplacementTable
from bowdenfit.kinds.shared_parameters import force_noise, offsets, rope, run_scatter
from bowdenfit.kinds.stretch.table import StretchTable
from bowdenfit.kinds.term import Circumstances
from bowdenfit.parameters.priors import HalfCauchy, LogNormal, Normal
from bowdenfit.parameters.scale import Scale
from bowdenfit.parameters.space import Parameter

END_SPRING, ROPE_STIFFNESS, ROPE_GIVE, DISPLACEMENT_NOISE = "end_spring", "rope_stiffness", "rope_give", "sigma_x"


def _level(table: DisplacementTable) -> Scale:
    """Range of forces over that of displacements."""
    force, x = table.force[table.used], table.displacement[table.used]
    ranges = [float(np.ptp(values)) if len(values) else 0.0 for values in (force, x)]
    together = ranges[0] / ranges[1] if min(ranges) > 0 else 1.0
    return Scale(together, "range of forces over that of displacements", "N/mm")


def _zeros(table: DisplacementTable, at: Circumstances) -> list[Parameter]:
    """Where each run has no force."""
    share, found = at.defaults.displacement_zero_ranges, []
    for run, name in enumerate(zero_names(table)):
        x = table.displacement[table.run == run]
        span = Scale(float(np.ptp(x)) or float(np.ptp(table.displacement)) or 1.0, "range of displacements", "mm")
        of_run = f", run {table.run_names[run]}" if len(table.run_names) > 1 else ""
        prior, symbol = Normal(float(x.min()), share * span.value), f"$x_{{0{run + 1 if of_run else ''}}}$"
        meaning = f"displacement without force{of_run}"
        found.append(Parameter(name, symbol, meaning, "elastic", prior, "mm", scaled_by=span.share(share)))
    return found


def parameters(table: DisplacementTable, at: Circumstances) -> list[Parameter]:
    """Spring, rope and zero; how readings and mountings scatter; the zero of the cell where that is fitted."""
    range_x = Scale(float(np.ptp(table.displacement)) or 1.0, "range of displacements", "mm")
    part = at.defaults.displacement_noise_share
    jitter = Parameter(
        DISPLACEMENT_NOISE, r"$\sigma_x$", at.noise.meaning("standard deviation of a displacement"), "noise",
        HalfCauchy(part * range_x.value), "mm", scaled_by=range_x.share(part),
    )  # fmt: skip
    return [
        *_stiffness(table, at),
        *_zeros(table, at),
        run_scatter(at),
        force_noise(at, at.noise.meaning("standard deviation of a force reading")),
        *([] if table.sliding else [jitter]),
        _offset(table, at),
    ]


def _stiffness(table: DisplacementTable, at: Circumstances) -> list[Parameter]:
    """Spring and rope; of a rope that nothing is said of how it gives beside the spring, which may be next to nothing."""
    by, settings = _level(table), at.description.table(DisplacementSettings)
    prior, rests = LogNormal(by.value, at.defaults.end_stiffness_log_sd), str(by)
    spring = Parameter(
        END_SPRING, r"$K$", "stiffness of the spring at the far end", "elastic", prior, "N/mm", scaled_by=rests
    )
    linear = Parameter(
        ROPE_STIFFNESS, "$k$ rope", "stiffness of rope and sheath together", "elastic", prior, "N/mm",
        scaled_by=rests,
    )  # fmt: skip
    give = Parameter(
        ROPE_GIVE, "$K/k$ rope", "give of rope and sheath over that of the spring at the far end", "elastic",
        HalfCauchy(at.defaults.rope_give),
    )  # fmt: skip
    at_stop = settings is not None and settings.end == "stop"
    if at.measurements.table(StretchTable) is not None:
        return [*rope(at), *([] if at_stop else [spring])]
    if at_stop:
        return [linear]
    return [spring, linear if ROPE_STIFFNESS in at.description.prior else give]


def _offset(table: DisplacementTable, at: Circumstances) -> Parameter:
    """What the cell shows of no force: a force that is off by little looks like friction, and the loop tells it."""
    stated = [p for p in offsets(at) if p.name == INPUT_OFFSET]
    if stated:
        return stated[0]
    part = at.defaults.motor_offset_share
    by = Scale(float(np.ptp(table.force)) or 1.0, "range of forces", "N")
    prior = Normal(0.0, part * by.value)
    meaning = "offset of the load cell at the motor"
    return Parameter(INPUT_OFFSET, "$b$ input", meaning, "sensor", prior, "N", scaled_by=by.share(part))
