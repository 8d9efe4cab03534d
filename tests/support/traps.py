"""A folder with a file for each module that is imported, and for settings of libraries: what follows them is caught."""

import os
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).parents[2]
PROGRAM = Path(sys.executable).with_name("bowdenfit")
CAUGHT = "CAUGHT"
# What is imported only for some files, engines and targets, whether or not it is installed.
OPTIONAL = (
    "asammdf", "bowdenfit", "dask", "distributed", "entrypoint", "fastapi", "h5netcdf", "h5py", "matplotlib", "multiprocessing",
    "nicegui", "nptdms", "openpyxl", "pyarrow", "rosbags", "scipy", "sitecustomize", "submitit", "tempfile", "usercustomize",
    "uvicorn",
)  # fmt: skip
_IMPORTS = """
import os, sys
os.environ["JAX_PLATFORMS"] = "cpu"
import bowdenfit as bf
bf.fit(sys.argv[1], seed=1, mcmc=False, output=sys.argv[2])
import multiprocessing.resource_tracker, multiprocessing.spawn, concurrent.futures.process
print(*sorted({name.partition(".")[0] for name in sys.modules}))
"""


def set_traps(folder: Path, scratch: Path) -> Path:
    """Make a folder of traps, each of which notes who imported it, and return it.

    Args:
        folder: New folder.
        scratch: New folder for a fit, whose imports name the traps.
    """
    command = [sys.executable, "-c", _IMPORTS, ROOT / "datasets" / "yarn-on-cylinder", scratch]
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=environment())
    names = {name for name in done.stdout.split() if name.isidentifier() and not name.startswith("__")} | {*OPTIONAL}
    assert len(names) > 200, names
    folder.mkdir()
    for name in names:
        note = f"open({str(folder / CAUGHT)!r}, 'a').write('{name}\\n')\n"
        (folder / f"{name}.py").write_text(note)
    metadata = folder / "entrypoint-1.0.dist-info"  # as of an installed package
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: entrypoint\nVersion: 1.0\n")
    groups = ("verbs", "kinds", "engines", "exports", "controllers", "schemas", "simulations")
    (metadata / "entry_points.txt").write_text("".join(f"[bowdenfit.{group}]\ntrap = entrypoint:TRAP\n" for group in groups))
    (folder / ".nicegui").mkdir()
    for settings in ("matplotlibrc", "arvizrc", ".nicegui/storage-general.json"):
        os.mkfifo(folder / settings)  # over which the library that reads it would wait for ever
    return folder


def environment(**more: str) -> dict[str, str]:
    """Environment of a user: without what protects child processes, or leads to the traps."""
    hidden = ("PYTHONSAFEPATH", "PYTHONPATH")
    return {name: value for name, value in os.environ.items() if name not in hidden} | more


def caught(folder: Path) -> list[str]:
    """Names of the traps that were imported."""
    note = folder / CAUGHT
    return sorted(set(note.read_text().split())) if note.exists() else []


def run_among(folder: Path, *command: object, codes: tuple[int, ...] = (0, 3), **more: str) -> str:
    """Run a command in the folder of traps, and return what it prints.

    Args:
        folder: Of traps.
        command: A program, or the words of a command of bowdenfit.
        codes: Exit codes that are right.
        more: Environment variables.
    """
    words = [str(word) for word in command]
    words = words if Path(words[0]).is_absolute() else [str(PROGRAM), *words]
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False, env=environment(**more), timeout=500)
    assert caught(folder) == [], (words, caught(folder), done.stderr[-2000:])
    assert done.returncode in codes, (words, done.stdout[-1000:], done.stderr[-2000:])
    return done.stdout


def run_until(folder: Path, *command: object, says: str, patience: float = 240.0) -> str:
    """Run a command that does not end by itself until it says something, then interrupt it; return what it said by then."""
    words, output = [str(PROGRAM), *map(str, command)], {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
    process = subprocess.Popen(words, cwd=folder, text=True, env=environment(), **output)
    assert process.stdout is not None
    heard, end = "", time.monotonic() + patience
    try:
        while says not in heard and time.monotonic() < end and (line := process.stdout.readline()):
            heard += line
    finally:
        process.terminate()
        process.communicate(timeout=60)
    assert says in heard, heard
    assert caught(folder) == [], caught(folder)
    return heard
