"""Read recordings and say how long it took: with bowdenfit, with the plain library, or a data set step by step.

    python scripts/baselines/read_recordings.py bowdenfit|plain FILE
    python scripts/baselines/read_recordings.py steps FOLDER

Each way imports what it needs inside the time that it shows.
"""

import json
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any
from unittest.mock import patch


def with_bowdenfit(file: Path) -> dict[str, float]:
    """All channels, with their names, units and clocks."""
    start = time.perf_counter()
    from bowdenfit.files import read_channels

    channels = read_channels(file).channels
    return {"seconds": time.perf_counter() - start, "rows": len(channels[0].values), "memory": peak()}


def plain(file: Path) -> dict[str, float]:
    """The table as pandas or Arrow gives it, its headings uninterpreted."""
    start = time.perf_counter()
    if file.suffix == ".parquet":
        from pyarrow import parquet

        rows = parquet.read_table(file).num_rows
    else:
        import pandas

        rows = len(pandas.read_csv(file))
    return {"seconds": time.perf_counter() - start, "rows": rows, "memory": peak()}


def peak() -> float:
    """Peak of the resident memory of this program, without that of the process that started it [MiB] (Linux only)."""
    status = Path("/proc/self/status")
    lines = status.read_text(encoding="ascii").splitlines() if status.exists() else []
    return next((float(line.split()[1]) / 1024 for line in lines if line.startswith("VmHWM")), float("nan"))


def steps(folder: Path) -> dict[str, float]:
    """Seconds of each step between the files and the arrays of the likelihood."""
    seconds: dict[str, float] = {}
    start = time.perf_counter()
    import bowdenfit
    from bowdenfit import dataset
    from bowdenfit.kinds.recordings import reader

    seconds["import bowdenfit"] = time.perf_counter() - start
    timed = {
        "read the files": (reader, "read_channels"),
        "flag, tare and find delays": (reader, "inspect_recording"),
        "average": (reader, "average_recording"),
        "find strokes": (reader, "find_strokes"),
        "checksums": (dataset, "_sha256"),
    }
    start = time.perf_counter()
    with ExitStack() as stack:
        for name, (module, function) in timed.items():
            stack.enter_context(patch.object(module, function, _timed(getattr(module, function), name, seconds)))
        data = bowdenfit.read(folder)
    seconds["other reading"] = time.perf_counter() - start - sum(seconds.get(name, 0.0) for name in timed)
    start = time.perf_counter()
    import jax

    from bowdenfit.models import build_model

    seconds["import JAX"] = time.perf_counter() - start
    start = time.perf_counter()
    with jax.enable_x64(True):
        build_model(data)
    seconds["build the model"] = time.perf_counter() - start
    return seconds


def _timed(function: Callable[..., Any], name: str, seconds: dict[str, float]) -> Callable[..., Any]:
    def run(*args: Any) -> Any:
        start = time.perf_counter()
        try:
            return function(*args)
        finally:
            seconds[name] = seconds.get(name, 0.0) + time.perf_counter() - start

    return run


if __name__ == "__main__":
    ways = {"bowdenfit": with_bowdenfit, "plain": plain, "steps": steps}
    print(json.dumps(ways[sys.argv[1]](Path(sys.argv[2]))))
