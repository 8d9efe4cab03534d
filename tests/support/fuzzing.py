"""The fuzzer: a numbered case mangles something valid, the command line or the library meets it, and what may come of it.

A case is its name and its number, so that any can be had again: `read_mangled_file(place, "a.mat", 17)`.
"""

import io
import random
import shutil
import signal
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path

from mangled_bytes import mangled
from mangled_inputs import DESCRIPTIONS, ODD_CELLS, ODD_VALUES, TABLES
from odd_inputs import BYTES, MORE_DESCRIPTIONS, MORE_TABLES, replace_file
from recorded_files import WRITERS, channels_of

import bowdenfit as bf

ROOT = Path(__file__).resolve().parents[2] / "datasets"
DATASETS = sorted(path for path in ROOT.iterdir() if (path / "cable.toml").exists())
LONGEST = 900  # characters of a sentence
LONGEST_LIST = 4000  # characters of what is wrong, a line each
SLOWEST = 20.0  # seconds of CPU
TEXTS = {".csv": "utf-8", ".cmbl": "utf-8", ".txt": "utf-16"}  # encodings of kinds of files that are text


class Wrong(AssertionError):
    """What a case must not do."""


@dataclass(frozen=True)
class Outcome:
    """What came of a case.

    Args:
        refused: Whether the input was refused; it was read otherwise.
        message: The words of the refusal.
    """

    refused: bool
    message: str = ""


@contextmanager
def ended_in_time() -> Iterator[None]:
    """End what takes far too long, as far as Python is asked meanwhile."""

    def end(*_: object) -> None:
        raise Wrong(f"takes more than {2 * SLOWEST:g} s")

    previous_handler = signal.signal(signal.SIGPROF, end)
    signal.setitimer(signal.ITIMER_PROF, 2 * SLOWEST)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, previous_handler)


def try_cases(numbers: Sequence[int], case: Callable[[int], Outcome]) -> int:
    """Return how many of the cases are refused.

    Args:
        numbers: Of the cases.
        case: Tries one.

    Raises:
        Wrong: What went wrong in any of them, when all are tried.
    """
    refused, wrong = 0, []
    for number in numbers:
        try:
            refused += case(number).refused
        except Wrong as error:
            wrong.append(str(error)[:1000])
    if wrong:
        raise Wrong("\n".join([f"{len(wrong)} of {len(numbers)} went wrong:", *wrong[:30]]))
    return refused


def meet(case: str, meets: Callable[[], object], *names: str) -> Outcome:
    """What comes of a case: the input is read, or refused in sentences that name it, in time and without other words.

    Args:
        case: How to have it again.
        meets: What meets the input.
        names: Of which the refusal has one.

    Raises:
        Wrong: Anything else.
    """
    out, err, start = io.StringIO(), io.StringIO(), time.process_time()
    try:
        with ended_in_time(), redirect_stdout(out), redirect_stderr(err), warnings.catch_warnings():
            warnings.simplefilter("ignore")  # as the command line does
            meets()
        outcome = Outcome(False)
    except bf.BowdenfitError as error:
        outcome = Outcome(True, str(error))
        lines = outcome.message.splitlines()
        sentences = [line.removeprefix("- ") for line in lines[len(lines) > 1 :]]
        good = all(10 < len(sentence) <= LONGEST and sentence.rstrip()[-1] in ".?)" for sentence in sentences)
        if not (good and error.exit_code == 2 and len(outcome.message) < LONGEST_LIST):
            raise Wrong(f"{case}: {error.exit_code}, {outcome.message}") from None
        if names and not any(name in outcome.message for name in names):
            raise Wrong(f"{case} does not name {names}: {outcome.message}") from None
    except Exception as error:
        raise Wrong(f"{case}: {type(error).__name__}: {error}") from error
    if out.getvalue() or err.getvalue():
        raise Wrong(f"{case}: printed {out.getvalue() + err.getvalue()}")
    if time.process_time() - start > SLOWEST:
        raise Wrong(f"{case}: took {time.process_time() - start:.0f} s")
    return outcome


def read_mangled_data_set(place: Path, name: str, number: int) -> Outcome:
    """A case of a table or a description.

    Args:
        place: Folder to work in.
        name: Of the data set.
        number: Of the case.
    """
    source, chance = ROOT / name, random.Random(f"{name} {number}")
    folder = shutil.copytree(source, place / "cable", ignore=shutil.ignore_patterns("*.md", "recordings"))
    for path in source.glob("recordings/*"):
        (folder / "recordings").mkdir(exist_ok=True)
        (folder / "recordings" / path.name).symlink_to(path)
    file = chance.choice(sorted(path.name for path in folder.iterdir() if path.suffix in {".csv", ".toml"}))
    text = (folder / file).read_text()
    for _ in range(chance.choice([1, 1, 2])):
        text = chance.choice(DESCRIPTIONS if file.endswith(".toml") else TABLES)(chance, text) or "\n"
    (folder / file).write_text(text, encoding="utf-8", errors="surrogatepass")
    files_at_start = set(place.rglob("*"))
    try:
        outcome = meet(f"{name} {number}, {file}", lambda: bf.read(folder))
        if set(place.rglob("*")) != files_at_start:
            raise Wrong(f"{name} {number}: files were written")
    finally:
        shutil.rmtree(folder)
    return outcome


def check_strange_data_set(place: Path, name: str, number: int) -> Outcome:
    """A case of a data set that is odd in more ways, or of which a file is something else, checked as `check` does.

    Args:
        place: Folder to work in.
        name: Of the data set.
        number: Of the case.
    """
    source, chance = ROOT / name, random.Random(f"strange {name} {number}")
    folder = shutil.copytree(source, place / "cable", ignore=shutil.ignore_patterns("*.md", "recordings"))
    for path in source.glob("recordings/*"):
        (folder / "recordings").mkdir(exist_ok=True)
        (folder / "recordings" / path.name).symlink_to(path)
    path = chance.choice(sorted(path for path in folder.iterdir() if path.suffix in {".csv", ".toml"}))
    ways = (*DESCRIPTIONS[:3], *MORE_DESCRIPTIONS) if path.suffix == ".toml" else (*TABLES[:3], *MORE_TABLES)
    changes = [chance.choice(ways) for _ in range(chance.choice((1, 1, 2)))]
    text = path.read_text()
    for change in changes:
        text = change(chance, text) or "\n"
    path.write_bytes(text.encode(errors=BYTES))
    case = f"strange {name} {number}, {path.name}: {', '.join(change.__name__ for change in changes)}"
    if chance.random() < 0.05:
        case += f", {replace_file(chance, path)}"
    files_at_start = set(place.rglob("*"))
    try:
        outcome = meet(case, lambda: str(bf.check(folder)))
        if set(place.rglob("*")) != files_at_start:
            raise Wrong(f"{case}: files were written")
    finally:
        shutil.rmtree(folder)
    return outcome


def valid_files(place: Path) -> dict[str, bytes]:
    """A valid file of every kind by its name, written into a folder."""
    place.mkdir()
    for name, write in WRITERS.items():
        write(place / name)
    return {name: (place / name).read_bytes() for name in WRITERS}


def read_mangled_file(place: Path, valid: dict[str, bytes], name: str, number: int) -> Outcome:
    """A case of a file of any kind.

    Args:
        place: Folder to work in.
        valid: The valid files, by their names.
        name: Of the kind of file.
        number: Of the case.
    """
    chance = random.Random(f"{name} {number}")
    encoding = TEXTS.get(Path(name).suffix)
    if encoding and chance.random() < 0.8:  # damage makes most texts no text, which is soon refused
        text = chance.choice(TABLES)(chance, valid[name].decode(encoding)) or "\n"
        (place / name).write_bytes(text.encode(encoding, errors="surrogatepass"))
    else:
        (place / name).write_bytes(mangled(chance, valid[name]))
    expected = {"wrap_angle": (180, "deg"), "channels": channels_of(name)}
    return meet(f"{name} {number}", lambda: bf.read(place / name, **expected), name, Path(name).stem)


SETTINGS = (
    "friction.mu1.fixed", "friction.mu1.prior", "tables.angles.file", "contact.0.friction", "contact.0.wrap_angle", "name",
    "schema", "noise", "sampler.max_steps", "sampler.n_walkers", "route.range", "route.unit", "tables.forces", "sensors",
    "sensors.input_force_noise", "prior.tau", "geometry", "friction_model", "contact", "", ".", "a..b", "contact.99.name",
)  # fmt: skip
QUANTITIES = ("input_force", "output_force", "velocity", "time", "stroke", "", "=", "efficiency", "x\x1b[2J")
OPTIONS: dict[str, Callable[[random.Random], str]] = {
    "--set": lambda c: f"{c.choice(SETTINGS)}={c.choice((*ODD_VALUES, *ODD_CELLS))}",
    "--channel": lambda c: f"{c.choice(QUANTITIES)}={c.choice(ODD_CELLS)}:{c.choice(ODD_CELLS)}",
    "--column": lambda c: f"{c.choice(QUANTITIES)}={c.choice(ODD_CELLS)}:{c.choice(ODD_CELLS)}",
    "--noise": lambda c: c.choice(("normal", "student", *ODD_CELLS)),
    "--friction": lambda c: "+".join(c.choices(("capstan", "drag", "load-dependent", "by-group", *ODD_CELLS), k=2)),
    "--geometry": lambda c: c.choice(("continuous", "published", *ODD_CELLS)),
    "--undetected": lambda c: c.choice(("zero", "dropped", *ODD_CELLS)),
    "--wrap-angle": lambda c: c.choice(ODD_CELLS) + c.choice(("deg", "rad", "N", "", " deg", "deg deg", "°")),
    "--reading-limit": lambda c: c.choice(("1", "1000", *ODD_CELLS)),
    "--seed": lambda c: c.choice(ODD_CELLS),
    "--input-force": lambda c: c.choice(ODD_CELLS) + c.choice(("N", "", "lbf")),
    "--top": lambda c: c.choice(ODD_CELLS),
    "--cost": lambda c: f"{c.choice(ODD_CELLS)}={c.choice(ODD_CELLS)}",
    "--candidate": lambda c: f"force@{c.choice(ODD_CELLS)}",
    "--replications": lambda c: c.choice(ODD_CELLS),
    "--truth": lambda c: c.choice((*ODD_CELLS, "/dev/zero", "/proc/self/mem")),
}  # fmt: skip
GOOD = {"--set": "sampler.max_steps=100", "--noise": "student", "--geometry": "continuous", "--reading-limit": "2"}


def run_mangled_options(run: Callable[[Sequence[str]], tuple[int, str, str]], number: int) -> Outcome:
    """A case of options of the command line.

    Args:
        run: Runs the command line on arguments: exit code, output and messages.
        number: Of the case.
    """
    chance = random.Random(f"options {number}")
    source = str(chance.choice(DATASETS)) if chance.random() < 0.8 else chance.choice(ODD_CELLS)
    # What fits, or asks a fit, is asked for a folder that is not there.
    verb = chance.choice((*["check"] * 20, "predict", "next", "calibrate", "length", "simulate"))
    words = [verb, source if verb == "check" else chance.choice(("/nowhere/at/all", *ODD_CELLS))]
    for _ in range(chance.choice((1, 1, 2, 3))):
        option = chance.choice(tuple(OPTIONS))
        good = chance.random() < 0.5 and verb == "check" and option in GOOD
        words += [option, GOOD[option] if good else OPTIONS[option](chance)]
    words = [item.replace("\0", "") for item in words]
    code, out, err = run(words)
    case = f"options {number}, {words}"
    ours = err.startswith(("Error: ", "Usage: ")) and "inside bowdenfit" not in err and "Traceback" not in err
    if code not in {0, 2} or (code == 2 and not ours) or len(err) > LONGEST_LIST or (code == 2 and out):
        raise Wrong(f"{case}: {code}, {err}")
    if not all(letter.isprintable() or letter in "\n\t\u00a0" for letter in out + err):
        raise Wrong(f"{case}: what steers a terminal is printed")
    return Outcome(code == 2, err)
