"""What has a default that most users keep: load cells, the sampler, and weak priors."""

from math import hypot
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from bowdenfit.description.values import Frozen, LogNormalPrior, NonNegative, Positive, QuantityValue

Sampler = Literal["emcee", "nuts", "both"]


class Sensors(Frozen):
    """What the data sheets of the load cells say: of each cell its relative gain error, one standard deviation."""

    force_noise: QuantityValue | None = None
    input_gain_error_sd: NonNegative | None = None
    output_gain_error_sd: NonNegative | None = None
    offset_sd: QuantityValue | None = None

    @model_validator(mode="before")
    @classmethod
    def _of_each_cell(cls, said: Any) -> Any:
        """A figure for both cells together is refused; folders of results stored with an empty one are read."""
        if not isinstance(said, dict) or "gain_error_sd" not in said:
            return said
        if (both := said["gain_error_sd"]) is not None:
            raise ValueError(
                f"gain_error_sd = {both} does not say whose error it is; write that of each load cell, as its data sheet gives "
                f"it: input_gain_error_sd = {both} and output_gain_error_sd = {both} (0 for a hung weight)"
            )
        return {name: value for name, value in said.items() if name != "gain_error_sd"}

    @model_validator(mode="after")
    def _of_both_cells(self) -> "Sensors":
        stated = {name: getattr(self, name) for name in ("input_gain_error_sd", "output_gain_error_sd")}
        missing = [name for name, sd in stated.items() if sd is None]
        if len(missing) == 1:
            raise ValueError(f"write {missing[0]} too, that of the cell at the other end (0 for a hung weight)")
        return self

    @property
    def gain_sd(self) -> float | None:
        """Standard deviation of the log ratio of both cells' gains [1]; None where nothing is said of either."""
        of_input, of_output = self.input_gain_error_sd, self.output_gain_error_sd
        return None if of_input is None or of_output is None else hypot(of_input, of_output)

    @property
    def largest_force_noise(self) -> float | None:
        """The stated noise of a force reading, with what its own error may add [N]; None where it is not stated."""
        said = self.force_noise
        return None if said is None else said.to("force") + 3 * (said.sd_to("force") or 0.0)


class SamplerSettings(Frozen):
    """How long and how carefully the posterior is sampled, by emcee's ensembles of walkers, by NUTS, or by both.

    `max_steps` is that of each walker or chain, and does not count the warm-up of NUTS.
    """

    method: Sampler = "emcee"
    n_ensembles: Annotated[int, Field(ge=2)] = 4
    n_walkers: Annotated[int, Field(ge=16, multiple_of=2)] = 256
    n_chains: Annotated[int, Field(ge=4)] = 16
    target_acceptance: Annotated[float, Field(ge=0.6, lt=1)] = 0.98
    max_steps: Annotated[int, Field(ge=200)] = 12000
    target_r_hat: Annotated[float, Field(gt=1)] = 1.01
    target_ess: Annotated[int, Field(ge=100)] = 1000


class PriorDefaults(Frozen):
    """The weak priors of everything the user says nothing of; angles in degrees, forces in N."""

    friction: LogNormalPrior = LogNormalPrior(median=0.12, log_sd=0.7)
    curve_level_sd: Positive = 1.5
    curve_level_degrees_without_data: Positive = 30.0
    curve_slope_sd: Positive = 3.0
    curve_curvature_sd: Positive = 0.5
    curve_steepness_sd: Positive = 5.0
    curve_end_over_median: Positive = 3.0
    angle_noise_degrees: Positive = 5.0
    run_scatter: Positive = 0.02
    force_noise_newtons: Positive = 2.0
    block_noise_newtons: Positive = 0.5
    offset_newtons: Positive = 1.0
    drag_newtons: Positive = 5.0
    wobble_degrees: Positive = 30.0
    stribeck: Positive = 0.3
    viscous_at_highest_speed: Positive = 0.5
    stribeck_speed_log_sd: Positive = 1.0
    stiffness: LogNormalPrior = LogNormalPrior(median=50.0, log_sd=1.5)
    bedding_stretch_mm: Positive = 2.0
    bedding_load: LogNormalPrior = LogNormalPrior(median=20.0, log_sd=1.0)
    lengthening_mm_per_radian: Positive = 1.0
    stretch_zero_mm: Positive = 5.0
    preload: LogNormalPrior = LogNormalPrior(median=20.0, log_sd=1.0)
    stretch_noise_mm: Positive = 0.1
    preload_noise_newtons: Positive = 2.0
