"""Results folders that somebody forged: a numbered case changes something, and mostly writes all checksums anew.

    python tests/support/forging.py FOLDER --seed 1 --seconds 600

tries every verb that reads a finished fit, each case in a copy of FOLDER, and prints how these end.
"""

import argparse
import contextlib
import faulthandler
import io
import json
import os
import random
import resource
import shutil
import signal
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from zlib import crc32

import h5py
import numpy as np
from fuzzing_results import ODD_ARRAYS, other_json
from sealed import sealed

from bowdenfit import cli
from bowdenfit.results.answer_cache import file_checksum

SLOWEST, LARGEST = 20, 2 << 20  # seconds, and kB
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
    what = chance.choice(WAYS)
    sealing = chance.random() < 0.85
    if what in ("fit", "answers"):
        path = folder / f"{what}.json"
        path.write_text(other_json(chance, path.read_text()), encoding="utf-8", errors="surrogatepass")
    elif what == "draws":
        forge_draws(chance, folder / "posterior.nc")
    elif what == "figures":
        with np.load(folder / "figures.npz") as file:
            arrays = dict(file)
        name = chance.choice(list(arrays))
        if name == "page":
            text = other_json(chance, arrays[name].tobytes().decode())
            arrays[name] = np.frombuffer(text.encode("utf-8", "surrogatepass"), np.uint8)
        else:
            arrays[name] = chance.choice(ODD_ARRAYS)
        written = io.BytesIO()
        chance.choice((np.savez, np.savez, np.savez, np.savez_compressed))(written, **arrays)
        if chance.random() < 0.2:
            np.save(folder / "figures.npy", np.zeros(1 << 20))
            written = io.BytesIO((folder / "figures.npy").read_bytes())
            (folder / "figures.npy").unlink()
        (folder / "figures.npz").write_bytes(written.getvalue())
    elif what == "text":
        path = folder / chance.choice(TEXTS)
        path.write_text(other_json(chance, path.read_text()) if path.suffix == ".json" else "You can trust this.\n")
        sealing = sealing and path.suffix == ".json"  # a text may be forged so that nobody can tell
    elif what == "deep":
        path = folder / chance.choice(("fit.json", "answers.json", "summary.json"))
        path.write_text('{"a":' * 900 + "1" + "}" * 900 if chance.random() < 0.5 else "[" * 100_000)
    else:
        path = chance.choice([path for path in folder.iterdir() if path.is_file() and path.suffix in {".json", ".nc", ".npz"}])
        if what == "gone":
            path.unlink()
        else:
            content = bytearray(path.read_bytes())
            for _ in range(chance.choice((1, 8, 64))):
                content[chance.randrange(len(content))] = chance.randrange(256)
            path.write_bytes(content[: chance.choice((len(content), len(content), len(content) // 2))])
    if sealing:
        reseal(folder)
    return f"{what}{' sealed' if sealing else ''}"


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


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("whole", type=Path)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seconds", type=float, default=600)
    request = parser.parse_args()
    ends, wrong, number, start = Counter[str](), 0, request.first, time.process_time()
    whole = request.whole.resolve()
    with tempfile.TemporaryDirectory() as place_name:
        place = Path(place_name)
        (place / "work").mkdir()
        os.chdir(place / "work")
        while time.process_time() - start < request.seconds:
            chance = random.Random(f"{request.seed} {number}")
            folder = place / "fit"
            shutil.copytree(whole, folder)
            what, verb = forge(chance, folder), chance.choice(VERBS)
            before, began = contents(place, folder), time.process_time()
            signal.setitimer(signal.ITIMER_PROF, 3 * SLOWEST)
            faulthandler.register(signal.SIGPROF)
            code, printed = ask(folder, verb)
            signal.setitimer(signal.ITIMER_PROF, 0)
            took, memory = time.process_time() - began, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
            (place / "work" / "x.csv").unlink(missing_ok=True)
            left = [str(p) for p in folder.rglob("*") if p.name.endswith(".partial") or p.name == ".lock"]
            faults = [code not in (0, 2, 3), took > SLOWEST, memory > LARGEST, bool(left), contents(place, folder) != before]
            ends[f"{verb[0]}: exit {code}"] += 1
            ends["all"] += 1
            if any(faults):
                wrong += 1
                case = f"WRONG {number} {what}, {' '.join(verb)}: exit {code}, {took:.0f} s, {memory >> 10} MB, {left}"
                print(case, printed[-1500:], flush=True)
            shutil.rmtree(folder)
            number += 1
    for end, count in sorted(ends.items()):
        print(end, count)
    print(f"{wrong} of {ends['all']} went wrong, up to number {number}")
    sys.exit(wrong > 0)


if __name__ == "__main__":
    main()
