"""Results folders that somebody forged: a numbered case changes something, and mostly writes all checksums anew.

Every verb that reads a finished fit meets them, each case in a copy of a folder.
"""

import contextlib
import io
import json
import random
import resource
import shutil
import sys
import time
from pathlib import Path
from zlib import crc32

import h5py
import numpy as np
from forged_fits import sealed
from fuzzing import SLOWEST, Outcome, Wrong, ended_in_time
from fuzzing_results import ODD_ARRAYS, other_arrays, other_json

from bowdenfit import cli
from bowdenfit.results.answer_cache import file_checksum

LARGEST = 2 << 20  # kB that this process may hold
ODD_DRAWS = (*ODD_ARRAYS, np.zeros((4, 5), dtype=np.float16), np.full((4, 5), np.inf))
WAYS = ("fit", "fit", "fit", "answers", "answers", "draws", "draws", "figures", "text", "bytes", "gone", "deep")
TEXTS = ("summary.txt", "details.txt", "summary.json")
VERBS = (
    ("summary",), ("summary", "--full"), ("summary", "--json"), ("length",), ("identify",), ("predict",), ("plot",),
    ("plot", "--width", "3.5in"), ("report",), ("export", "--to", "csv", "-o", "x.csv"), ("check",),
)  # fmt: skip


def reseal(folder: Path) -> None:
    """Write all checksums anew, as far as the files can be read."""
    with contextlib.suppress(ValueError, TypeError, KeyError, AttributeError, OSError, RecursionError):
        page = json.loads((folder / "fit.json").read_text())
        page["posterior_crc32"] = file_checksum(folder / "posterior.nc")
        (folder / "fit.json").write_text(sealed(page))
    with contextlib.suppress(ValueError, TypeError, KeyError, AttributeError, OSError, RecursionError):
        page = json.loads((folder / "answers.json").read_text())
        page["of"] = {name: file_checksum(folder / name) for name in ("fit.json", "posterior.nc", "figures.npz")}
        page["answers"]["texts"] = {name: file_checksum(folder / name) for name in TEXTS}
        (folder / "answers.json").write_text(sealed(page))


def forge(chance: random.Random, folder: Path) -> str:
    """Change something in a folder, and return what."""
    way = chance.choice(WAYS)
    sealing = chance.random() < 0.85
    if way in ("fit", "answers"):
        path = folder / f"{way}.json"
        path.write_text(other_json(chance, path.read_text()), encoding="utf-8", errors="surrogatepass")
    elif way == "draws":
        forge_draws(chance, folder / "posterior.nc")
    elif way == "figures":
        arrays, written = other_arrays(chance, folder / "figures.npz"), io.BytesIO()
        chance.choice((np.savez, np.savez, np.savez, np.savez_compressed))(written, **arrays)
        if chance.random() < 0.2:
            np.save(folder / "figures.npy", np.zeros(1 << 20))
            written = io.BytesIO((folder / "figures.npy").read_bytes())
            (folder / "figures.npy").unlink()
        (folder / "figures.npz").write_bytes(written.getvalue())
    elif way == "text":
        path = folder / chance.choice(TEXTS)
        path.write_text(other_json(chance, path.read_text()) if path.suffix == ".json" else "You can trust this.\n")
        sealing = sealing and path.suffix == ".json"  # a text may be forged so that nobody can tell
    elif way == "deep":
        path = folder / chance.choice(("fit.json", "answers.json", "summary.json"))
        path.write_text('{"a":' * 900 + "1" + "}" * 900 if chance.random() < 0.5 else "[" * 100_000)
    else:
        path = chance.choice([path for path in folder.iterdir() if path.is_file() and path.suffix in {".json", ".nc", ".npz"}])
        if way == "gone":
            path.unlink()
        else:
            content = bytearray(path.read_bytes())
            for _ in range(chance.choice((1, 8, 64))):
                content[chance.randrange(len(content))] = chance.randrange(256)
            path.write_bytes(content[: chance.choice((len(content), len(content), len(content) // 2))])
    if sealing:
        reseal(folder)
    return f"{way}{' sealed' if sealing else ''}"


def forge_draws(chance: random.Random, path: Path) -> None:
    """Other draws, of a type, shape or value that no fit has."""
    with np.errstate(all="ignore"), h5py.File(path, "a") as file:
        group = file[chance.choice(list(file))]
        name = chance.choice([name for name in group if isinstance(group[name], h5py.Dataset)])
        values = group[name][()]
        odd = chance.randrange(7)
        del group[name]
        if odd == 0:
            return
        if odd == 1:
            values = chance.choice(ODD_DRAWS)
        elif odd == 2 and values.dtype.kind == "f":
            values = values.astype(chance.choice((np.float16, np.float32, np.int64, ">f8")))
        elif odd == 3 and values.dtype.kind == "f" and values.size:
            values.flat[0] = chance.choice((np.nan, np.inf, 1e300))
        elif odd == 4 and values.ndim and len(values) > 1:
            values = values[:-1]
        elif odd == 5:
            values = np.array(["x"] * 3, dtype="S1")
        elif values.dtype.kind == "f":
            values = values * 1e200
        group[name] = values if values.dtype.kind != "U" else values.astype("S")


def contents(place: Path, leave_out: Path) -> dict[Path, int]:
    """Checksums of all files but those of a folder."""
    return {p: crc32(p.read_bytes()) for p in place.rglob("*") if p.is_file() and leave_out not in p.parents}


def ask(folder: Path, verb: tuple[str, ...]) -> tuple[int, str]:
    """Exit code of a verb asked of a folder, and what it says on standard error."""
    sys.argv = ["bowdenfit", verb[0], str(folder), *verb[1:]]
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            cli.main()
        except SystemExit as stop:
            return int(stop.code or 0), err.getvalue()
    return 0, err.getvalue()


def peak_memory() -> int:
    """The most memory that this process has had [KiB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def ask_forged_folder(place: Path, whole: Path, number: int) -> Outcome:
    """Ask something of a folder that is forged; nothing but an answer or a refusal may come of it, nor may files be left.

    Args:
        place: The current folder, which is empty.
        whole: The folder of a fit.
        number: Of the case.

    Raises:
        Wrong: Something else did.
    """
    chance = random.Random(f"forged {number}")
    folder = shutil.copytree(whole, place / "fit")
    try:
        way, verb = forge(chance, folder), chance.choice(VERBS)
        initial, start, most = contents(place, folder), time.process_time(), peak_memory()
        with ended_in_time():
            code, printed = ask(folder, verb)
        seconds, memory = time.process_time() - start, peak_memory() - most  # beyond what tests before it have taken
        (place / "x.csv").unlink(missing_ok=True)
        left = [path.name for path in folder.rglob("*") if path.name.endswith(".partial") or path.name == ".lock"]
        wrong = code not in (0, 2, 3) or seconds > SLOWEST or memory > LARGEST or left or contents(place, folder) != initial
    finally:
        shutil.rmtree(folder)
    if wrong:
        case = f"forged {number}, {way}, {' '.join(verb)}: exit code {code}, {seconds:.0f} s, {memory >> 10} MB, left {left}"
        raise Wrong(f"{case}, {printed[-1500:]}")
    return Outcome(code == 2, printed)
