"""Parameters that several kinds of measurement ask for, each declared in one place."""

from dataclasses import replace

from bowdenfit.cable.elasticity import preload_parameter, rope_parameters
from bowdenfit.cable.load_cells import FORCE_NOISE, GAIN_ERROR, INPUT_OFFSET, OUTPUT_OFFSET, RUN_SCATTER
from bowdenfit.description import Description
from bowdenfit.kinds.term import Circumstances
from bowdenfit.parameters.priors import HalfNormal, Normal, TruncatedNormal
from bowdenfit.parameters.space import Parameter


def run_scatter(at: Circumstances) -> Parameter:
    """Scatter from mounting to mounting, of readings that are made of one mounting each."""
    meaning = at.noise.meaning("scatter of the log ratio from mounting to mounting")
    return Parameter(RUN_SCATTER, r"$\tau$", meaning, "noise", HalfNormal(at.defaults.run_scatter))


def force_noise(at: Circumstances, meaning: str) -> Parameter:
    """Noise of a force reading: free, or as the data sheet says, with its standard deviation or without."""
    stated, prior = at.description.sensors.force_noise, HalfNormal(at.defaults.force_noise_newtons)
    free = Parameter(FORCE_NOISE, r"$\sigma_F$", meaning, "noise", prior, "N")
    if stated is None:
        return free
    if stated.sd is None:
        return replace(free, fixed=stated.to("force"), prior_words="fixed (data sheet)")
    return replace(free, prior=TruncatedNormal(stated.to("force"), stated.sd_to("force") or 0.0))


def offsets(at: Circumstances) -> list[Parameter]:
    """What each load cell shows of no force, where the description says that this is fitted."""
    if not at.description.fits_offsets:
        return []
    stated = at.description.sensors.offset_sd
    sd = stated.to("force") if stated is not None else at.defaults.offset_newtons
    return [
        Parameter(
            name, f"$b_\\mathrm{{{symbol}}}$", f"offset of the {end} load cell", "sensor",
            Normal(0.0, sd), "N",
        )
        for name, symbol, end in ((INPUT_OFFSET, "in", "input"), (OUTPUT_OFFSET, "out", "output"))
    ]  # fmt: skip


def gain_error(description: Description) -> list[Parameter]:
    """The relative gain error between the two load cells, where the description says how large that of each may be."""
    sd = description.sensors.gain_sd
    if not sd:
        return []
    meaning = "relative gain error between the two load cells"
    return [Parameter(GAIN_ERROR, "$g$", meaning, "sensor", Normal(0.0, sd))]


def preload(at: Circumstances) -> list[Parameter]:
    """What readings that depend on the preload need: the preload, and the rope where bending changes it."""
    rope = rope_parameters(at.defaults) if at.description.preload_follows_stretch else []
    return [*rope, preload_parameter(at.description, at.defaults.preload)]
