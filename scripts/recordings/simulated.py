"""The recordings that are measured: simulated data sets, and the files made of them."""

import tomllib
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from benchmark_tables import say
from processes import ROOT, byte_code, search_path

from bowdenfit.questions.simulate.recordings import make_recordings, write_recordings
from bowdenfit.questions.simulate.recordings_plan import parse_recordings_plan

PLAN = ROOT / "datasets" / "synthetic-recordings" / "bench.toml"
LENGTHS = list(range(430, 530, 10))  # mm
RATE = 250.0  # samples a second
STROKE_TIME = 2.0  # s, with its pause; a cycle is 1000 samples
STROKE, ACCELERATION_TIME, DRUM_RADIUS, SPEED = 60.0, 0.1, 20.0, 20.0  # mm, s, mm, r/min
SEED = 20220728


@dataclass(frozen=True)
class Size:
    """How much is measured.

    Args:
        samples: Samples for the play operator, and rows of a file.
        cycles: Cycles of a long recording.
        repeats: Fresh processes a number.
        bytes: Size of a large file.
    """

    samples: int
    cycles: int
    repeats: int
    bytes: int


@dataclass(frozen=True)
class Simulated:
    """The data sets that more than one part needs, made when first asked for."""

    folder: Path
    size: Size
    against: Path | None = None

    @cached_property
    def short(self) -> Path:
        """Ten recordings of one cycle."""
        return self._made("short", 1)

    @cached_property
    def long(self) -> Path:
        """Ten recordings of many cycles."""
        return self._made("long", self.size.cycles)

    @cached_property
    def long_parquet(self) -> Path:
        """The long recordings as Parquet."""
        return apart(as_parquet, self.long, self.folder / "long_parquet")

    @property
    def environment(self) -> dict[str, str]:
        """What measured processes share: neither byte code nor the list of fonts is a compiled program."""
        return byte_code(self.folder) | {"MPLCONFIGDIR": str(self.folder / "matplotlib"), "PYTHONPATH": search_path()}

    @cached_property
    def one_file(self) -> tuple[Path, Path]:
        """One recording with as many rows as wanted, as CSV and as Parquet."""
        return apart(one_file, self.long, self.folder, self.size.samples)

    def _made(self, name: str, cycles: int) -> Path:
        folder = self.folder / name
        return folder if folder.exists() else apart(simulate, folder, cycles)


def apart(function: Callable[..., Any], *arguments: Any) -> Any:
    """What a function returns, from a process of its own.

    A process counts the memory of the one that started it into its peak, so that this one has to stay small.
    """
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as process:
        return process.submit(function, *arguments).result()


def simulate(folder: Path, cycles: int) -> Path:
    """Write a data set of ten recordings."""
    say(f"(simulating {len(LENGTHS)} recordings, cycles each: {cycles})")
    text = PLAN.read_text(encoding="utf-8")
    plan = parse_recordings_plan(tomllib.loads(text) | {"recordings": recordings_page(cycles)}, text)
    write_recordings(make_recordings(plan, SEED), folder)
    return folder


def recordings_page(cycles: int) -> dict[str, Any]:
    """The [recordings] of a plan."""
    moving = STROKE / (SPEED * 2 * np.pi / 60 * DRUM_RADIUS) + ACCELERATION_TIME
    profile = {"stroke": STROKE, "drum_radius": DRUM_RADIUS, "acceleration_time": ACCELERATION_TIME}
    return {
        "lengths": LENGTHS,
        "speeds": [f"{SPEED:g} r/min"],
        "angles": list(range(430, 540, 10)),
        "profile": profile | {"pause": STROKE_TIME - moving, "cycles": cycles},
        "bench": {"rate": RATE},
    }


def as_parquet(folder: Path, copy: Path) -> Path:
    """A copy of a data set with its recordings in Parquet."""
    (copy / "recordings").mkdir(parents=True)
    for file in sorted((folder / "recordings").iterdir()):
        to_parquet(file, copy / "recordings" / f"{file.stem}.parquet")
    description = (folder / "cable.toml").read_text(encoding="utf-8")
    (copy / "cable.toml").write_text(description.replace("rpm.csv", "rpm.parquet"), encoding="utf-8")
    (copy / "angles.csv").write_bytes((folder / "angles.csv").read_bytes())
    return copy


def to_parquet(file: Path, copy: Path) -> None:
    """Write a CSV file as Parquet."""
    from pyarrow import csv, parquet

    parquet.write_table(csv.read_csv(file), copy)


def one_file(long: Path, folder: Path, samples: int) -> tuple[Path, Path]:
    """The long recordings put one after the other, as CSV and as Parquet."""
    heading, body = "", []
    for file in sorted((long / "recordings").iterdir()):
        heading, *lines = file.read_text(encoding="ascii").splitlines()
        body += [line.partition(",")[2] for line in lines]
    text = "\n".join([heading, *(f"{i / RATE:.6f},{line}" for i, line in enumerate(body[:samples]))])
    csv, parquet = folder / "one.csv", folder / "one.parquet"
    csv.write_text(f"{text}\n", encoding="ascii")
    to_parquet(csv, parquet)
    return csv, parquet
