"""What has a default that most users keep: load cells, the sampler, and weak priors."""

from math import hypot
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from bowdenfit.description.values import Frozen, LogNormalPrior, NonNegative, Positive, QuantityValue

Sampler = Literal["emcee", "nuts", "importance", "both"]
FEWEST_WALKERS = 128  # of an ensemble, where nothing is said of it; twice as many cost twice as much and settle no sooner
WALKERS_PER_PARAMETER = 4  # so that a distribution can be fitted to half of them
THIN = 10  # steps of a walker from one state that is stored to the next; draws are those of the second half
KEPT_PER_WALKER = 20  # least number of draws kept of each walker, spread over the second half of its path
KEPT_OF_CHAINS = 20_480  # least number of draws kept of all chains of NUTS, evenly spread; as many as of walkers by default
_OR_ZERO = BeforeValidator(lambda stated: {"value": 0.0, "unit": "N"} if stated == 0 else stated)  # 0 needs no unit


class Sensors(Frozen):
    """What the data sheets of the load cells say: of each cell its relative gain error, one standard deviation.

    Both cells have the same noise unless `input_force_noise` says what the input's is: 0 of a weight that hangs there, or
    that of a better cell, beside `force_noise`, which is then the output's.

    A ratio is the force on the rope over the force that its cell reads, where a lever, pulley or drum stands between them.
    Readings are multiplied by it as they are read; all other forces of the description are those on the rope.
    """

    force_noise: QuantityValue | None = None
    input_force_noise: Annotated[QuantityValue | None, _OR_ZERO] = None
    input_gain_error_sd: NonNegative | None = None
    output_gain_error_sd: NonNegative | None = None
    offset_sd: QuantityValue | None = None
    input_ratio: Positive = 1.0
    output_ratio: Positive = 1.0

    @model_validator(mode="before")
    @classmethod
    def _of_each_cell(cls, settings: Any) -> Any:
        """Return a figure for both cells together is refused; folders of results stored with an empty one are read."""
        if not isinstance(settings, dict) or "gain_error_sd" not in settings:
            return settings
        if (both := settings["gain_error_sd"]) is not None:
            raise ValueError(
                f"gain_error_sd = {both} does not say whose error it is; write that of each load cell, as its data sheet gives "
                f"it: input_gain_error_sd = {both} and output_gain_error_sd = {both} (0 for a hung weight)"
            )
        return {name: value for name, value in settings.items() if name != "gain_error_sd"}

    @model_validator(mode="after")
    def _of_both_cells(self) -> "Sensors":
        stated = {name: getattr(self, name) for name in ("input_gain_error_sd", "output_gain_error_sd")}
        missing = [name for name, sd in stated.items() if sd is None]
        if len(missing) == 1:
            raise ValueError(f"write {missing[0]} too, that of the cell at the other end (0 for a hung weight)")
        return self

    @model_validator(mode="after")
    def _ratio_known(self) -> "Sensors":
        of_input, of_output = self.input_force_noise, self.force_noise
        if of_input is not None and (of_input.value < 0 or of_input.sd is not None):
            raise ValueError("input_force_noise is a standard deviation without one of its own; write 0 or more, without sd")
        if of_input is not None and of_input.value > 0 and (of_output is None or not of_output.value > 0):
            raise ValueError(
                "input_force_noise needs force_noise as well, the noise of the output's cell, so that their ratio is known; "
                "write 0 for a hung weight, which has none"
            )
        return self

    def ratio(self, end: str) -> float:
        """Force on the rope over the reading of the cell at one end, "input" or "output" [1]."""
        return self.input_ratio if end == "input" else self.output_ratio

    @property
    def noise_ratio(self) -> float:
        """Noise of an input's reading over that of an output's [1]."""
        of_input, of_output = self.input_force_noise, self.force_noise
        if of_input is None:
            return 1.0
        return of_input.to("force") / of_output.to("force") if of_input.value and of_output is not None else 0.0

    @property
    def gain_sd(self) -> float | None:
        """Standard deviation of the log ratio of both cells' gains [1]; None where nothing is said of either."""
        of_input, of_output = self.input_gain_error_sd, self.output_gain_error_sd
        return None if of_input is None or of_output is None else hypot(of_input, of_output)

    @property
    def largest_force_noise(self) -> float | None:
        """The stated noise of a force reading, with what its own error may add [N]; None where it is not stated."""
        noise = self.force_noise
        return None if noise is None else noise.to("force") + 3 * (noise.sd_to("force") or 0.0)


class BenchErrors(Frozen):
    """Errors of a bench that its readings may not show, each as the limit that it does not exceed; 0 leaves one out.

    The usual limits are those of a class 1 force measurement (ISO 7500-1: +-1 % of accuracy, 1.5 % of reversibility, 0.1 % of
    zero), and of a goniometer, whose readings of one bend differ from photographs by 2.4 to 3.4 deg, one standard deviation
    (Fish and Wingate, Physical Therapy 65 (1985), 1666); 3 % is the same of the bends of 90 to 180 deg that most cables have.
    Those of wear, load exponent and compression are judgements; so is that load cells share no signal, which is stated as
    crosstalk.
    """

    gain: NonNegative = 0.01
    hysteresis: NonNegative = 0.015
    wear: NonNegative = 0.05
    load_exponent: NonNegative = 0.03
    compression: NonNegative = 0.03
    angle: QuantityValue = QuantityValue(value=3, unit="deg")
    angle_scale: NonNegative = 0.03
    zero: NonNegative = 0.001
    crosstalk: NonNegative = 0.0


class SamplerSettings(Frozen):
    """How long and how carefully the posterior is sampled, by emcee's ensembles of walkers, by NUTS, or by both.

    Where no method is stated, importance sampling serves few parameters whose scatter the readings determine, and densities
    that take milliseconds (dahl and lugre); walkers follow if its draws do not suffice, and serve everything else.

    `max_steps` is that of each walker or chain, and does not count the warm-up of NUTS. Walkers of which nothing is said are
    as many as it takes to fit a distribution to half of them, and enough to draw from at the first look.
    """

    method: Sampler | None = None
    n_ensembles: Annotated[int, Field(ge=2, le=100)] = 4
    n_walkers: Annotated[int, Field(ge=16, le=10_000, multiple_of=2)] | None = None
    n_chains: Annotated[int, Field(ge=4, le=1000)] = 16
    target_acceptance: Annotated[float, Field(ge=0.6, lt=1)] = 0.98
    max_steps: Annotated[int, Field(ge=200, le=10_000_000)] = 12000
    target_r_hat: Annotated[float, Field(gt=1)] = 1.01
    target_ess: Annotated[int, Field(ge=100)] = 1000

    def walkers(self, size: int) -> int:
        """Walkers of each ensemble for so many parameters."""
        return self.n_walkers or max(FEWEST_WALKERS, WALKERS_PER_PARAMETER * size)

    def numbers_while_sampling(self, size: int) -> int:
        """Numbers in all states after `max_steps`, for so many parameters; of two samplers the more."""
        of_walkers = self.n_ensembles * self.walkers(size) * size * self.max_steps // THIN
        of_chains = self.n_chains * size * self.max_steps
        return {"nuts": of_chains, "both": max(of_walkers, of_chains)}.get(self.method or "emcee", of_walkers)

    def kept_draws(self, size: int) -> int:
        """Draws that a fit of so many parameters keeps."""
        of_walkers, enough = self.n_ensembles * self.walkers(size) * KEPT_PER_WALKER, 2 * self.target_ess
        return max(enough, KEPT_OF_CHAINS if self.method == "nuts" else of_walkers)

    @property
    def most_draws(self) -> int:
        """Draws that there can be after `max_steps`, even if none depended on the one before; of two samplers the fewer."""
        of_walkers = self.n_ensembles * self.walkers(0) * self.max_steps // (2 * THIN)
        of_chains = self.n_chains * self.max_steps
        return {"nuts": of_chains, "both": min(of_walkers, of_chains)}.get(self.method or "emcee", of_walkers)


class PriorDefaults(Frozen):
    """The weak priors of everything the user says nothing of; angles in degrees.

    What has a unit of force or of stretch is in proportion to what was measured, so that no answer depends on how strong a
    bench is. Scales of noise are half-Cauchy. That of mountings holds 90 % between 0.002 and 0.32, from mounts on dowel pins
    to ones that nobody could repeat; that of coefficients between 0.012 and 1.2, from lubricated PTFE to rubber. A narrower one
    makes intervals too narrow wherever readings hardly tell coefficients apart and one of them is an unusual one.
    """

    friction: LogNormalPrior = LogNormalPrior(median=0.12, log_sd=1.4)
    curve_level_sd: Positive = 1.5
    curve_level_degrees_without_data: Positive = 30.0
    curve_slope_sd: Positive = 6.0
    curve_half_ranges: Positive = 1.0
    curve_steepness_sd: Positive = 5.0
    curve_end_over_median: Positive = 3.0
    departure_share: Positive = 0.05
    smooth_over_median: Positive = 1.0
    angle_noise_degrees: Positive = 3.0
    run_scatter: Positive = 0.025
    force_noise_share: Positive = 0.02
    stretch_noise_share: Positive = 0.005
    preload_noise_share: Positive = 0.05
    offset_share: Positive = 0.025
    drag_share: Positive = 0.05
    largest_gear_loss: Positive = 0.8
    wobble_degrees: Positive = 30.0
    wobble_per_m: Positive = 0.1
    stribeck: Positive = 0.3
    stroke_difference: Positive = 0.3
    presliding_stiffness: Positive = 20.0
    bristle_damping_ms: Positive = 10.0
    viscous_at_highest_speed: Positive = 0.5
    stribeck_speed_log_sd: Positive = 1.0
    stiffness_log_sd: Positive = 1.5
    stretch_mm_without_data: Positive = 1.0
    bedding_load_log_sd: Positive = 1.0
    lengthening_mm_per_radian_without_data: Positive = 1.0
    stretch_zero_share: Positive = 2.0
    preload_log_sd: Positive = 1.0
    end_stiffness_log_sd: Positive = 2.0
    rope_give: Positive = 0.5
    displacement_zero_ranges: Positive = 2.0
    displacement_noise_share: Positive = 0.0005
    motor_offset_share: Positive = 0.05
