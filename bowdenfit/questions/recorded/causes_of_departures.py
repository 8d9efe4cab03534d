"""What in recordings makes losses depart from the model: a rope that creeps after its reversals, and slow noise of a cell."""

from bowdenfit.inference.lack_of_fit import Departure
from bowdenfit.kinds.recordings.blocks import RECORDED
from bowdenfit.recordings.bench_faults import shows_creep
from bowdenfit.recordings.recording import Recordings
from bowdenfit.results.record import Record, cached_per_fit
from bowdenfit.words import significant

_SLOW_NOISE = 0.07  # judged: slow noise over the force, from which it changes losses by percents


def describe_creep(fit: Record, departure: Departure) -> str:
    """Describe a rope that creeps in recordings whose model lets friction hold at once; empty where none does."""
    if not _is_inside_recordings(departure) or not _shows_creep(fit):
        return ""
    return (
        "After its reversals the rope creeps: its friction builds up while the output moves already, and readings from before "
        "it is there lose less. Fit again with --friction dahl."
    )


@cached_per_fit
def _shows_creep(fit: Record) -> bool:
    recordings = fit.dataset.measurements.table(Recordings)
    if recordings is None or recordings.loop or fit.model.cable.friction.counts_turns:
        return False
    return any(shows_creep(recording) for recording in recordings.items)


def describe_slow_noise(fit: Record, departure: Departure) -> str:
    """Describe noise of a load cell that blocks do not average out, and that is large for the lowest loads; empty without."""
    recordings = fit.dataset.measurements.table(Recordings)
    if recordings is None or not _is_inside_recordings(departure):
        return ""
    for recording in recordings.items:
        account = recording.account
        for name, sd, time in zip(("input_force", "output_force"), account.sample_sd, account.noise_time, strict=True):
            if time > 0 and sd > _SLOW_NOISE * departure.low:
                percent = significant(100 * sd / departure.low, 2)
                return (
                    f"The likeliest cause is noise: that of {name} in {recording.name} is {significant(sd, 2)} N and stays "
                    f"alike for {significant(time, 2)} s, so that averaging takes little of it, and {percent} % of the lowest "
                    "loads, where the rope seems to slide with each of its peaks. Record with less noise (shielding, another "
                    "amplifier) or larger loads."
                )
    return ""


def _is_inside_recordings(departure: Departure) -> bool:
    """Return whether blocks of recordings depart, not whole runs or another table."""
    return departure.inside and departure.table == RECORDED
