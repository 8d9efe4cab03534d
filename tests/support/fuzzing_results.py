"""Results that somebody edited or a disk damaged: a numbered case mangles one file of a folder that a verb wrote.

What is mangled is text, bytes, or what stands inside a file whose checksum is then written anew, so that a reader's own
checks are met and not the checksum alone.
"""

import io
import json
import random
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from fuzzing import Outcome, meet
from mangled_bytes import mangled

import bowdenfit as bf
from bowdenfit.addons.fleet.folder import CHECKSUM, FLEET_DRAWS, FLEET_PAGE, FleetDraws, write_fleet_draws
from bowdenfit.addons.fleet.pieces import PieceFit
from bowdenfit.addons.fleet.store import SEPARATOR, FleetStore, read_start
from bowdenfit.dataset import Dataset
from bowdenfit.inference.checkpoint import append_record, read_records
from bowdenfit.inference.engines import installed_versions
from bowdenfit.inference.ensemble import CheckpointedBackend
from bowdenfit.questions.calibrate.replications import (
    RankedTruth,
    Replication,
    append_replication,
    open_replications,
    read_seed,
)
from bowdenfit.results import folder as names
from bowdenfit.results.answer_cache import file_checksum, read_answers
from bowdenfit.run.preparing import choose_seed

ODD_JSON: tuple[Any, ...] = (
    None, True, -1, 0, 1e400, float("nan"), "", "x", "1", "NaN", [], {}, [[]], {"": 0}, [1, "a", None], 10**30, -0.5,
    "\x1b[31m",
)  # fmt: skip
ODD_ARRAYS: tuple[Any, ...] = (
    np.array(5), np.zeros(0), np.zeros((2, 3, 4, 5)), np.array(["a", "b"]), np.full((3, 2), np.nan), np.array([1 + 2j]),
    np.array(True), np.arange(3, dtype=np.uint8), np.array([["x"]]),
)  # fmt: skip


WALKERS = 4, 2  # and parameters
SHAPES = {"z": WALKERS, "log_density": WALKERS[:1], "accepted": WALKERS[:1]}
SHAPES |= {"random_key": (624,), "random_place": (2,), "random_normal": ()}


def other_json(chance: random.Random, text: str) -> str:
    """A page of JSON with another value, a key less, or a key more, anywhere."""
    try:
        page = json.loads(text)
    except ValueError:
        return text[: len(text) // 2]
    for _ in range(chance.choice((1, 1, 3))):
        inside = page
        while isinstance(inside, dict | list) and inside:
            key = chance.choice(list(inside) if isinstance(inside, dict) else range(len(inside)))
            if not isinstance(inside[key], dict | list) or not inside[key] or chance.random() < 0.3:
                break
            inside = inside[key]
        else:
            return json.dumps(chance.choice(ODD_JSON))
        how = chance.randrange(4)
        if how == 0:
            del inside[key]
        elif how == 1 and isinstance(inside, dict):
            inside[f"{key}x"] = inside.pop(key)
        else:
            inside[key] = chance.choice(ODD_JSON)
    return json.dumps(page)


def other_lines(chance: random.Random, text: str) -> str:
    """Lines of JSON, one of them another, twice, gone, or cut."""
    lines = text.splitlines()
    index, how = chance.randrange(len(lines)), chance.randrange(5)
    if how == 0:
        del lines[index]
    elif how == 1:
        lines.insert(index, lines[chance.randrange(len(lines))])
    elif how == 2:
        lines[index] = chance.choice(("", "null", "[]", "{}", lines[index][: len(lines[index]) // 2], "[" * 3000, "9" * 5000))
    else:
        lines[index] = other_json(chance, lines[index])
    return "\n".join(lines) + "\n"


def mangle(chance: random.Random, path: Path) -> None:
    """Another file in its place."""
    content = path.read_bytes()
    if path.name == names.CHAIN and chance.random() < 0.6:
        return _mangle_checkpoint(chance, path)
    if path.suffix == ".npz" and chance.random() < 0.5:
        return _mangle_arrays(chance, path)
    if path.suffix == ".json" and chance.random() < 0.7:
        path.write_text(other_json(chance, content.decode()))
    elif path.suffix == ".jsonl" and chance.random() < 0.7:
        path.write_text(other_lines(chance, content.decode()), encoding="utf-8", errors="surrogatepass")
    else:
        path.write_bytes(mangled(chance, content))
    return None


def _mangle_checkpoint(chance: random.Random, path: Path) -> None:
    """Another heading, or records with other arrays, whose checksums are right."""
    lines, records = path.read_bytes().split(b"\n", 2), read_records(path, SHAPES)
    first = other_json(chance, lines[1].decode()) if chance.random() < 0.5 else lines[1].decode()
    path.write_bytes(lines[0] + b"\n" + first.encode("utf-8", "surrogatepass") + b"\n")
    for record in records:
        if chance.random() < 0.5:
            name = chance.choice(list(record))
            if chance.random() < 0.3:
                del record[name]
            else:
                record[name] = chance.choice(ODD_ARRAYS)
        append_record(path, record)


def other_arrays(chance: random.Random, path: Path) -> dict[str, np.ndarray]:
    """The arrays of an archive, one of them another."""
    with np.load(path) as file:
        arrays = dict(file)
    name = chance.choice(list(arrays))
    if name == "page":
        text = other_json(chance, arrays[name].tobytes().decode())
        arrays[name] = np.frombuffer(text.encode("utf-8", "surrogatepass"), np.uint8)
    else:
        arrays[name] = chance.choice(ODD_ARRAYS)
    return arrays


def _mangle_arrays(chance: random.Random, path: Path) -> None:
    """Other arrays in an archive of them."""
    written = io.BytesIO()
    np.savez(written, **other_arrays(chance, path))
    path.write_bytes(written.getvalue())


def interrupted_fit(place: Path, data: Dataset) -> Path:
    """The folder of a fit that was ended after some steps; for `resume_fit`."""
    from bowdenfit.run.preparing import start_checkpointing

    place.mkdir()
    path = start_checkpointing(place, data, 3, resume=False)
    assert path is not None  # a folder has one
    chance = np.random.RandomState(1)
    backend = CheckpointedBackend(WALKERS, path, resume=False)
    import emcee

    backend.grow(3, None)
    for _ in range(3):
        state = emcee.State(chance.randn(*WALKERS), log_prob=chance.randn(4), random_state=chance.get_state())
        backend.save_step(state, np.ones(4, dtype=bool))
    return place


def resume_fit(folder: Path, data: Dataset) -> None:
    """What `fit --resume` reads."""
    choose_seed(folder, data, mcmc=True, seed=None, resume=True, force=False)
    CheckpointedBackend(WALKERS, folder / names.CHAIN, resume=True)


FINGERPRINT = {"description": {"name": "x"}, "sha256": {"a.csv": "0"}, "seed": 3, "assumed": [], "truths": {}}


def begun_calibration(place: Path) -> Path:
    """The folder of a calibration that was ended."""
    place.mkdir()
    open_replications(place, FINGERPRINT, resume=False, force=False)
    for number in range(3):
        ranked = {"mu": RankedTruth(0.1, 0.2, 0.3, 0.4), "optimal_length": RankedTruth(float("inf"), 1.0, 0.1, 0.5)}
        append_replication(place, Replication(number, {"too few": 1}, (), ranked, 1.0, 20, "laplace"))
    return place


def resume_calibration(folder: Path) -> None:
    """What `calibrate --resume` reads, and makes of it."""
    from bowdenfit.questions.calibrate.rank_tests import summarize_replications

    read_seed(folder)
    records = open_replications(folder, FINGERPRINT, resume=True, force=False)
    summarize_replications(tuple(records.values()), {}, name="x", seed=3, assumed=(), truths=())


def begun_fleet(place: Path) -> Path:
    """The folder of a fleet that was finished once, and then ended while cables were added."""
    place.mkdir()
    store = FleetStore(place, {"seed": 3, "versions": installed_versions()})
    store.open(resume=False, force=False)
    chance, labels = np.random.default_rng(1), ("a", "b after 5 cycles", "c")
    values = {"mu": chance.normal(size=(3, 8)), "tau": chance.normal(size=(3, 8))}
    texts = {"engine": ["laplace"] * 3, "reasons": ["", SEPARATOR.join("xy"), ""], "shape": ["k"] * 3, "input": list("abc")}
    stats = {name: np.array(column, dtype=object) for name, column in texts.items()}
    stats |= {"pareto_k": np.zeros(3), "n_effective": np.ones(3), "trusted": np.ones(3, dtype=bool)}
    about = {"name": "x", "seed": 3, "versions": installed_versions(), "quantities": {"k": ["mu", "tau"]}}
    nothing = np.full(3, np.nan)
    attributes = {"mu": {"units": "1"}}
    fleet = FleetDraws(labels, ("a", "b", "c"), nothing, nothing, nothing, values, stats, attributes, about)
    write_fleet_draws(place / FLEET_DRAWS, fleet)
    page = {"seed": 3, "versions": installed_versions(), "fitted": [], CHECKSUM: file_checksum(place / FLEET_DRAWS)}
    (place / FLEET_PAGE).write_text(json.dumps(page) + "\n")
    store.keep([PieceFit(name, np.ones((2, 8)), "laplace", 0.1, 400.0, ("why",)) for name in "de"])
    return place


def resume_fleet(folder: Path) -> None:
    """What `fleet --resume` reads."""
    initial = read_start(folder)
    store = FleetStore(folder, {"seed": int(initial["seed"]), "versions": installed_versions()}).open(resume=True, force=False)
    assert all(isinstance(fit, PieceFit) and fit.values.ndim == 2 for fit in store.values())


def ask_fit(folder: Path) -> None:
    """What questions read of a finished fit."""
    from bowdenfit.questions.figures import read_figure_data

    read_answers(folder)
    read_figure_data(folder)
    fit = bf.load(folder)
    fit.summary()
    fit.verdict()


def read_mangled_results(
    place: Path, whole: Path, name: str, number: int, meets: Callable[[Path], object], *message: str
) -> Outcome:
    """A case of a file in a results folder.

    Args:
        place: Folder to work in.
        whole: A results folder.
        name: Of the file, or a pattern of one.
        number: Of the case.
        meets: What reads the folder.
        message: What a refusal names one of; the file or the folder if omitted.
    """
    folder = place / "results"
    shutil.copytree(whole, folder)
    (file,) = folder.glob(name)
    mangle(random.Random(f"{name} {number}"), file)
    try:
        outcome = meet(f"{name} {number}", lambda: meets(folder), *(message or (file.name, str(folder))))
    finally:
        shutil.rmtree(folder)
    return outcome
