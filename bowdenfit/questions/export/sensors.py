"""What an exported estimator assumes of the sensors that it reads, from the description and the fitted recordings."""

from dataclasses import dataclass

import numpy as np

from bowdenfit.questions.predict.measured_range import find_measured_range
from bowdenfit.recordings.recording import Recordings
from bowdenfit.results.record import Record

_ZERO = 0.001  # of the largest load: the zero of a force measurement of class 1 (ISO 7500-1)
_LATENCY = 0.01  # s by which two channels may differ where nothing is known: some cycles of a field bus; a judgement


@dataclass(frozen=True)
class SensorErrors:
    """What is known of the sensors that an online estimator reads: standard deviations; of what has a limit, the limit.

    An error as large as its limit is then inside a 90 % interval.

    Args:
        force_sd: Noise of a sample of either cell [N]; NaN where no recording tells it.
        noise_time: Correlation time of that noise [s]; 0 if it is white.
        gain_sd: Of the logarithm of the output cell's gain over the input cell's [1].
        zero_sd: Of the zero of either cell [N].
        latency_sd: Of the time by which the output is measured later or earlier than the input [s].
    """

    force_sd: float = np.nan
    noise_time: float = 0.0
    gain_sd: float = 0.0
    zero_sd: float = 0.0
    latency_sd: float = 0.0


def estimate_sensors(fit: Record) -> SensorErrors:
    """Estimate the sensors of a fit; of both cells those of the noisier.

    Args:
        fit: The fit.
    """
    description, loads = fit.dataset.description, find_measured_range(fit).loads
    sensors, recordings = description.sensors, fit.dataset.measurements.table(Recordings)
    largest_load = loads[1] if loads is not None else fit.model.cable.friction.conditions.reference_force
    accounts = [] if recordings is None else [item.account for item in recordings.items]
    noise = float(np.median([max(account.sample_sd) for account in accounts])) if accounts else 0.0
    stated_noise = np.nan if sensors.force_noise is None else sensors.force_noise.to("force")
    return SensorErrors(
        noise or stated_noise,
        float(np.median([max(account.noise_time) for account in accounts])) if accounts else 0.0,
        float(np.sqrt(2) * description.errors.gain) if sensors.gain_sd is None else sensors.gain_sd,
        _ZERO * largest_load if sensors.offset_sd is None else sensors.offset_sd.to("force"),
        max([_LATENCY, *(abs(account.delay) for account in accounts)]),
    )
