"""One bench as two loggers write it, each a file of its own with its own clock and rate; no code of the package is used."""

from pathlib import Path

import numpy as np
from support.recorded_benches import RecordedBench, channels

RATES = (200.0, 130.0)  # Hz


def write_loggers(
    folder: Path,
    bench: RecordedBench,
    seed: int,
    *,
    shift: float = 5.3,
    drift: float = 0.0,
    rates: tuple[float, float] = RATES,
    pause: float = 0.0,
    origins: tuple[float, float] = (0.0, 0.0),
    entry: str = "",
) -> Path:
    """A data set of one recording in two files.

    Args:
        folder: Where it goes.
        bench: What is recorded, at a rate well above those of the loggers.
        seed: Of all that is random.
        shift: How much later the output's logger was started [s].
        drift: By how much its clock runs faster [1].
        rates: Samples a second of both.
        pause: How long the rope stands before the motion [s]; both see it.
        origins: What each clock shows at its first sample, such as Unix times [s].
        entry: More lines of the [[recording]].
    """
    folder.mkdir(parents=True, exist_ok=True)
    generator = np.random.default_rng(seed)
    columns = channels(bench, generator)
    time, forces = columns["time_s"] + pause, (columns["input_force_N"], columns["output_force_N"])
    begins = np.arange(0.0, time[-1] * 0.97, 1 / rates[0]), np.arange(shift, time[-1], 1 / rates[1])
    for name, begin, force, origin, fast in zip("io", begins, forces, origins, (0.0, drift), strict=True):
        clock = origin + (begin - begin[0]) * (1 + fast)
        shown = np.interp(begin, time, force) + (begin < pause) * bench.load * bench.noise * generator.standard_normal(
            len(begin)
        )
        table = np.column_stack([clock, shown])
        np.savetxt(folder / f"{name}.csv", table, ("%.6f", "%.7g"), ",", header="time_s,Force (N)", comments="")
    (folder / "cable.toml").write_text(
        'schema = 1\nname = "bench"\n[[contact]]\nname = "cable"\nfriction = "mu"\nwrap_angle = { value = 180, unit = "deg" }\n'
        f'[[recording]]\nfile = "i.csv"\noutput_file = "o.csv"\n{entry}\n'
    )
    return folder
