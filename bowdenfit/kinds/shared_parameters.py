"""Parameters that several kinds of measurement need, each declared once."""

from dataclasses import replace

import numpy as np

from bowdenfit.cable.elasticity import RopeScales, preload_parameter, rope_parameters
from bowdenfit.cable.sensors import (
    FORCE_NOISE,
    GAIN_ERROR,
    GEAR_FRICTION,
    GEAR_LOSS,
    INPUT_OFFSET,
    OUTPUT_OFFSET,
    RUN_SCATTER,
)
from bowdenfit.description import Description
from bowdenfit.kinds.tables import LoopTable, PreloadTable, StretchTable
from bowdenfit.kinds.term import Circumstances
from bowdenfit.parameters.priors import HalfCauchy, Normal, TruncatedNormal, Uniform
from bowdenfit.parameters.space import Parameter, Scale


def declare_run_scatter(at: Circumstances) -> Parameter:
    """Return tau, the scatter from mounting to mounting."""
    meaning = at.noise.meaning("scatter of the log ratio from mounting to mounting")
    return Parameter(RUN_SCATTER, r"$\tau$", meaning, "noise", HalfCauchy(at.defaults.run_scatter))


def declare_force_noise(at: Circumstances, meaning: str = "standard deviation of a force reading") -> Parameter:
    """Return the noise of an output force reading: free, fixed, or with the prior of the data sheet."""
    stated, ratio = at.description.sensors.force_noise, at.description.sensors.noise_ratio
    meaning += "" if ratio == 1 else f" at the output; at the input {f'{ratio:.3g} times that' if ratio else 'none'}"
    free = declare_noise_of_forces(at, FORCE_NOISE, r"$\sigma_F$", meaning)
    if stated is None:
        return free
    if stated.sd is None:
        return replace(free, fixed=stated.to("force"), prior_words="fixed (data sheet)", scaled_by="")
    return replace(free, prior=TruncatedNormal(stated.to("force"), stated.sd_to("force") or 0.0), scaled_by="")


def declare_noise_of_forces(at: Circumstances, name: str, symbol: str, meaning: str) -> Parameter:
    """Return a noise of forces whose prior is in proportion to the loads."""
    load, part = at.cable.friction.conditions.load, at.defaults.force_noise_share
    return Parameter(name, symbol, meaning, "noise", HalfCauchy(part * load.value), "N", scaled_by=load.describe_share(part))


def declare_offsets(at: Circumstances) -> list[Parameter]:
    """Return the offset of each load cell, where the description says that offsets are fitted."""
    if not at.description.fits_offsets:
        return []
    stated, load, part = at.description.sensors.offset_sd, at.cable.friction.conditions.load, at.defaults.offset_share
    sd, by = (stated.to("force"), "") if stated is not None else (part * load.value, load.describe_share(part))
    return [
        Parameter(
            name, f"$b$ {end}", f"offset of the {end} load cell", "sensor",
            Normal(0.0, sd), "N", scaled_by=by,
        )
        for name, end in ((INPUT_OFFSET, "input"), (OUTPUT_OFFSET, "output"))
    ]  # fmt: skip


def declare_gear(at: Circumstances) -> list[Parameter]:
    """Return loss and friction of the gear of a motor that was read in the place of the input's load cell."""
    motor, radius = at.description.motor, at.description.pulleys.input_radius
    if motor is None or radius is None:
        return []
    load, share, shown = at.cable.friction.conditions.load, at.defaults.drag_share, radius / 1000
    loss = Parameter(
        GEAR_LOSS, r"$1-\eta$", "share of the torque that the gear of the motor loses", "sensor",
        Uniform(0.0, at.defaults.largest_gear_loss),
    )  # fmt: skip
    friction = Parameter(
        GEAR_FRICTION, "$T_g$", "friction of the gear of the motor, at its output", "sensor",
        HalfCauchy(share * load.value), "N*m", shown, scaled_by=load.describe_share(share),
    )  # fmt: skip
    efficiency, torque = motor.gear_efficiency, motor.gear_friction
    if efficiency is not None:
        loss = _with_stated(loss, 1 - efficiency.to("ratio"), efficiency.sd_to("ratio"))
    if torque is not None:
        sd = torque.sd_to("torque")
        friction = _with_stated(friction, torque.to("torque") / radius, None if sd is None else sd / radius)
    return [loss, friction]


def _with_stated(parameter: Parameter, value: float, sd: float | None) -> Parameter:
    """Return a parameter that is not negative as it is stated: exact without a standard deviation."""
    if sd is None:
        return replace(parameter, fixed=value, prior_words="fixed (as stated)", scaled_by="")
    return replace(parameter, prior=TruncatedNormal(value, sd), scaled_by="")


def declare_gain_error(description: Description) -> list[Parameter]:
    """Return the relative gain error between the load cells, where the description says how large that of each may be."""
    sd = description.gain_sd
    if not sd:
        return []
    ends = "the two load cells" if description.motor is None else "the motor and the load cell at the output"
    meaning = f"relative gain error between {ends}"
    return [Parameter(GAIN_ERROR, "$g$", meaning, "sensor", Normal(0.0, sd))]


def declare_preload(at: Circumstances) -> list[Parameter]:
    """Return the parameter of the preload, and those of the rope where bending changes the preload."""
    own = declare_rope(at) if at.description.preload_follows_stretch else []
    return [*own, preload_parameter(at.description, at.defaults, preload_scale(at))]


def preload_scale(at: Circumstances) -> Scale:
    """Return the scale of the preload: as read, or else by the force that a loop loses, or else the loads."""
    table, loop = at.measurements.table(PreloadTable), at.measurements.table(LoopTable)
    taut = table.preload[table.preload > 0] if table is not None else np.zeros(0)
    if len(taut):
        return Scale(float(np.median(taut)), "median preload", "N")
    if loop is not None:  # while both sides are taut it loses 2 P Lambda
        lost = loop.stroke * (loop.input_force - loop.output_force)
        lost, bend = lost[np.isfinite(lost)], float(np.median(np.nansum(loop.own.angle, axis=1)))
        if len(lost) and np.median(lost) > 0 and bend > 0:
            preload = float(np.median(lost)) / (2 * at.defaults.friction.median * bend)
            return Scale(preload, "preload of which usual friction loses the median loss", "N")
    return at.cable.friction.conditions.load


def declare_rope(at: Circumstances) -> list[Parameter]:
    """Return the parameters of stretch and lengthening, with priors by the stretch that was read."""
    return rope_parameters(at.defaults, _rope_scales(at))


def _rope_scales(at: Circumstances) -> RopeScales:
    """Return the scales of the stretch that was read; of the loads and a usual stretch where none was."""
    load, table = at.cable.friction.conditions.load, at.measurements.table(StretchTable)
    usual, bend = at.defaults.stretch_mm_without_data, at.defaults.lengthening_mm_per_radian_without_data
    if table is None or not (np.ptp(table.stretch) > 0 and np.ptp(table.load) > 0):
        stiffness = Scale(load.value / usual, f"{load.name} over {usual:g} mm", "N/mm")
        return RopeScales(load, stiffness, Scale(usual, "usual stretch", "mm"), _usual_lengthening(bend))
    stretch, loads = float(np.ptp(table.stretch)), float(np.ptp(table.load))
    bent = float(np.ptp(table.wrap_angle))
    return RopeScales(
        Scale(float(np.median(table.load)), "median load of the stretch", "N"),
        Scale(loads / stretch, "range of loads over that of stretch", "N/mm"),
        Scale(stretch, "range of stretch", "mm"),
        Scale(stretch / bent, "range of stretch over that of wrap angles", "mm/rad")
        if bent
        else _usual_lengthening(bend),
    )


def _usual_lengthening(by_radian: float) -> Scale:
    return Scale(by_radian, "usual lengthening", "mm/rad")
