"""What runs for long and may be ended: its command, what it keeps, and what it finds when nothing ends it."""

import json
import shutil
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SMALL = ("sampler.n_walkers=32", "sampler.max_steps=600", "sampler.target_ess=100")
PHASES = START, COMPILE, SAMPLE, WRITE = range(4)
INSPECTIONS = 18  # of the fleet


@dataclass(frozen=True)
class Job:
    """Something long that may be ended.

    Args:
        name: What it is.
        words: Of its command, before the results folder.
        checkpoint: File or folder that lets it go on.
        done: File that is there once it has finished.
        samples: Whether, by what is kept, something has been drawn.
        phases: In which it is struck.
    """

    name: str
    words: tuple[str, ...]
    checkpoint: str
    done: str
    samples: Callable[[Path], bool] = Path.exists
    phases: tuple[int, ...] = PHASES

    def command(self, folder: Path, *more: str) -> list[str]:
        """Its command."""
        return [sys.executable, "-m", "bowdenfit", *self.words, "-o", str(folder), "--seed", "3", *more]

    def phase(self, folder: Path) -> int:
        """What it does, by what lies in its folder."""
        try:
            other_files = {path.name for path in folder.iterdir() if not path.match(".*.partial")} - {self.checkpoint, ".lock"}
            return WRITE if other_files else SAMPLE if self.samples(folder / self.checkpoint) else COMPILE
        except FileNotFoundError:
            return START

    def result(self, folder: Path) -> object:
        """What it found, to be compared."""
        if self.done == "fit.json":
            import bowdenfit as bf

            return bf.load(folder).posterior.z.tobytes()
        if self.done == "fleet.json":
            from bowdenfit.addons.fleet.folder import read_fleet_draws

            fleet = read_fleet_draws(folder)
            return fleet.label, {name: values.tobytes() for name, values in fleet.values.items()}
        lines = [json.loads(line) for line in (folder / self.checkpoint).read_text().splitlines()[1:]]
        return sorted((line["number"], json.dumps(line["ranked"])) for line in lines)


def has_lines(path: Path) -> bool:
    """Whether replications stand behind the heading."""
    return path.exists() and path.read_bytes().count(b"\n") > 1


def has_pieces(folder: Path) -> bool:
    """Whether a piece of a fleet is kept."""
    return any(folder.glob("*.npz"))


SET = tuple(f"--set={setting}" for setting in SMALL)
YARN = str(ROOT / "datasets" / "yarn-on-cylinder")
FLEET = ROOT / "datasets" / "synthetic-fleet"
JOBS = (
    Job("emcee", ("fit", YARN, "--no-figures", *SET), "chain.checkpoint", "fit.json"),
    Job("nuts", ("fit", YARN, "--no-figures", "--sampler", "nuts", *SET), "chain.checkpoint", "fit.json"),
    Job("calibrate", ("calibrate", YARN, "--replications", "6"), "replications.jsonl", "calibration.json", has_lines),
    Job("writing", ("fit", YARN, *SET), "chain.checkpoint", "fit.json", phases=(SAMPLE, WRITE, WRITE, WRITE)),
)


def fleet_job(place: Path) -> Job:
    """The fit of a small fleet, by two processes where that pays; its measurements are laid into a folder."""
    shutil.copytree(FLEET / "readings", place / "readings")
    shutil.copy(FLEET / "fleet.toml", place)
    lines = (FLEET / "fleet.csv").read_text(encoding="utf-8").splitlines()[: INSPECTIONS + 1]
    (place / "fleet.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return Job("fleet", ("fleet", str(place), "--workers", "2"), "kept", "fleet.json", has_pieces)
