"""The fuzzer of what other verbs read: a device.toml, a study of walking, and a fleet with its table of inspections."""

import json
import random
import shutil
from collections.abc import Callable
from pathlib import Path

import jax
from fuzzing import ROOT, Outcome, Wrong, meet
from mangled_inputs import DESCRIPTIONS, ODD_CELLS, TABLES

import bowdenfit as bf
from bowdenfit.addons.device.description import read_device
from bowdenfit.addons.device.description_keys import KEYS
from bowdenfit.addons.fleet.inspections import read_cases, read_inspections, refuse_if_none_usable
from bowdenfit.results.serialization import plain_data

INSPECTIONS = 3  # of the fleet that is mangled
LONG, DEEP = "9" * 4400, "[" * 600 + "]" * 600
# What strangers write where a number or a name is asked for, besides what is odd anywhere.
HEX = "0x" + "F" * 5000  # which Python reads and does not write out
ODDER = (
    LONG, HEX, f"1e{LONG[:30]}", f'"{LONG}"', f'"0.{"1" * 400}"', DEEP, '"\\u001b[2J"', '"a\\u0000b"', '"\\u202e"', '"=1+1"',
    f'"{"x" * 5000}"', '"NAME"', f"{{ value = {HEX} }}", f'{{ value = {HEX}, unit = "{"u" * 3000}" }}',
)  # fmt: skip
ODD_LINES = (
    f"{'a.' * 400}b = 1\n", f"{'k' * 5000} = 1\n", '"\\u001b[2J" = 1\n', "[[condition]]\n", "[motor]\n", "[other]\n", '"" = 1\n'
)  # fmt: skip


def _stranger(chance: random.Random, text: str) -> str:
    """A value that nobody would write, or a line."""
    lines = text.splitlines(keepends=True)
    index = chance.randrange(len(lines))
    if chance.random() < 0.3 or "=" not in lines[index]:
        lines.insert(index, chance.choice(ODD_LINES))
    else:
        lines[index] = f"{lines[index].partition('=')[0]}= {chance.choice(ODDER)}\n"
    return "".join(lines)


def _person(chance: random.Random, text: str) -> str:
    """A name of a person, a condition, a cable or a file, of an odd kind."""
    odd = ("\x1b[2J", "a\0b", "../" * 30 + "x", "/dev/zero", "=1+1", "x" * 3000, "٣", "\u202e", "a\nb", "*", "[a]", "nan", "-")
    lines = text.splitlines(keepends=True)
    index = chance.randrange(len(lines))
    cells = lines[index].rstrip("\n").split(",")
    cells[chance.randrange(len(cells))] = chance.choice((*odd, *ODD_CELLS))
    return "".join([*lines[:index], ",".join(cells) + "\n", *lines[index + 1 :]])


def device(place: Path) -> Path:
    """A folder with a device.toml."""
    place.mkdir()
    shutil.copy(ROOT / "haptic-teleoperation" / "device.toml", place)
    return place


def meet_device(folder: Path) -> None:
    """All that is asked of a device."""
    device_file = read_device(folder / "device.toml")
    device_file.known(*KEYS)
    device_file.needed("an answer", "motor.inertia", "joint.inertia")
    assert device_file.count > 0


def printed_study(place: Path) -> Path:
    """A study of which means were printed."""
    place.mkdir()
    shutil.copy(ROOT / "on-body-metabolic" / "metabolic.toml", place)
    return place


def study_of_persons(place: Path) -> Path:
    """A study with a table of persons."""
    place.mkdir()
    (place / "metabolic.toml").write_text('schema = 1\nname = "x"\ntable = "t.csv"\nrest = "rest"\norder = ["a", "b"]\n')
    chance, rows = random.Random(1), ["person,condition,VO2_ml_per_min,VCO2_ml_per_min,mass_kg"]
    for person in "PQRS":
        for condition, oxygen in (("rest", 300), ("a", 1000), ("b", 1100)):
            rows.append(f"{person},{condition},{oxygen + chance.randrange(80)},{oxygen - chance.randrange(80)},70")
    (place / "t.csv").write_text("\n".join(rows) + "\n")
    return place


def meet_study(folder: Path) -> None:
    """All forms of its answer."""
    study = bf.metabolic(folder)
    assert str(study) and study.to_csv()
    json.dumps(plain_data(study), allow_nan=False)


def fleet(place: Path) -> Path:
    """A fleet of a few inspections."""
    (place / "readings").mkdir(parents=True)
    source = ROOT / "synthetic-fleet"
    shutil.copy(source / "fleet.toml", place)
    lines = (source / "fleet.csv").read_text().splitlines()[: INSPECTIONS + 1]
    (place / "fleet.csv").write_text("\n".join(lines) + "\n")
    for line in lines[1:]:
        shutil.copy(source / line.split(",")[-1], place / "readings")
    return place


def meet_fleet(folder: Path) -> None:
    """Everything about it that is read."""
    with jax.enable_x64(True):
        cases = list(read_cases(folder, read_inspections(folder), {}))
    broken = [case for case in cases if hasattr(case, "why")]
    refuse_if_none_usable([case for case in cases if not hasattr(case, "why")], broken)
    for item in broken:
        if len(item.why) > 2000 or "Traceback" in item.why:
            raise Wrong(item.why)


FOLDERS: dict[str, tuple[Callable[[Path], Path], Callable[[Path], None]]] = {
    "device": (device, meet_device),
    "printed study": (printed_study, meet_study),
    "study of persons": (study_of_persons, meet_study),
    "fleet": (fleet, meet_fleet),
}


def read_mangled_folder(place: Path, name: str, number: int) -> Outcome:
    """A case of one of these.

    Args:
        place: Folder to work in.
        name: Of `FOLDERS`.
        number: Of the case.
    """
    make, meets = FOLDERS[name]
    folder, chance = make(place / "folder"), random.Random(f"{name} {number}")
    file = chance.choice(sorted(path for path in folder.iterdir() if path.is_file()))
    text = file.read_text()
    for _ in range(chance.choice([1, 1, 2])):
        ways = (*DESCRIPTIONS, _stranger, _stranger) if file.suffix == ".toml" else (*TABLES, _person, _person)
        text = chance.choice(ways)(chance, text) or "\n"
    file.write_text(text, encoding="utf-8", errors="surrogatepass")
    files_at_start = set(place.rglob("*"))
    try:
        outcome = meet(f"{name} {number}, {file.name}", lambda: meets(folder))
        if set(place.rglob("*")) != files_at_start:
            raise Wrong(f"{name} {number}: files were written")
    finally:
        shutil.rmtree(folder)
    return outcome
