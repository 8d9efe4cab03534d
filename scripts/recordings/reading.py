"""Reading of one file, of a size that is usual and of one that hardly fits."""

import json
from collections.abc import Iterator
from pathlib import Path

from benchmark_tables import Table, say
from processes import BASELINES, Run, measured, typical

from recordings.simulated import RATE, Simulated, apart

LARGE_TARGET = 1536.0  # MiB


def reading_tables(simulated: Simulated) -> Iterator[Table]:
    """Reading of one file, in CSV and in Parquet."""
    samples, repeats = simulated.size.samples, simulated.size.repeats
    files = simulated.one_file
    rows = [
        [f"reading of {samples} rows", "file [MiB]", "reading [s]", "process [s]", "peak [MiB]", "ratio", "process"]
    ]
    for file in files:
        runs = {}
        for way in ("plain", "bowdenfit"):
            say(f"reading {file.suffix}, {way}")
            reader(simulated, way, file)
            runs[way] = typical([reader(simulated, way, file) for _ in range(repeats)])
        base = runs["plain"]
        library = "pyarrow.parquet.read_table" if file.suffix == ".parquet" else "pandas.read_csv"
        for way, run in runs.items():
            name = f"{file.suffix[1:]}, {library if way == 'plain' else 'bowdenfit read_channels'}"
            numbers = [f"{file.stat().st_size / 1024**2:.1f}", f"{inside(run):.2f}", f"{run.seconds:.2f}"]
            ratios = [f"{inside(run) / inside(base):.2f}", f"{run.seconds / base.seconds:.2f}"]
            rows.append([name, *numbers, f"{inside(run, 'memory'):.0f}", *ratios])
    yield rows


def reader(simulated: Simulated, way: str, path: Path) -> Run:
    """A fresh process that reads."""
    return measured([str(BASELINES / "read_recordings.py"), way, str(path)], simulated.environment)


def inside(run: Run, case: str = "seconds") -> float:
    """What a reading process showed for itself."""
    return json.loads(run.output)[case]


def large_tables(simulated: Simulated) -> Iterator[Table]:
    """Reading of one file of a size that hardly fits."""
    file = apart(large_file, simulated.long, simulated.folder / "large.csv", simulated.size.bytes)
    say("reading a large file")
    run = reader(simulated, "bowdenfit", file)
    rows = [["reading of a large CSV file", "file [MB]", "rows", "reading [s]", "peak [MiB]", "target [MiB]"]]
    numbers = f"{file.stat().st_size / 1e6:.0f}", f"{inside(run, 'rows'):.0f}", f"{inside(run):.1f}"
    yield [*rows, ["bowdenfit read_channels", *numbers, f"{inside(run, 'memory'):.0f}", f"{LARGE_TARGET:.0f}"]]


def large_file(long: Path, file: Path, size: int) -> Path:
    """The first of the long recordings again and again, with a clock that goes on."""
    heading, *lines = min((long / "recordings").iterdir()).read_text(encoding="ascii").splitlines()
    rows = [line.partition(",")[2] for line in lines]
    with file.open("w", encoding="ascii") as stream:
        stream.write(f"{heading}\n")
        start = 0
        while stream.tell() < size:
            stream.writelines(f"{(start + i) / RATE:.3f},{row}\n" for i, row in enumerate(rows))
            start += len(rows)
    return file
