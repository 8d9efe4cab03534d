"""What has a default that most users keep: load cells, the sampler, and weak priors."""

from typing import Annotated, Literal

from pydantic import Field

from bowdenfit.description.values import Frozen, LogNormalPrior, Positive, QuantityValue

Sampler = Literal["emcee", "nuts", "both"]


class Sensors(Frozen):
    """What the data sheets of the load cells say."""

    force_noise: QuantityValue | None = None
    gain_error_sd: Positive | None = None
    offset_sd: QuantityValue | None = None


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
