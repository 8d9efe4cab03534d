"""Too little memory, or too few addresses: a sentence, since libraries crash or wait for ever; and what was done is kept."""

import os
import subprocess
import sys
from types import SimpleNamespace

import pytest

import bowdenfit as bf
from bowdenfit.errors import MemoryShortageError
from bowdenfit.inference.engines import memory

LIMITED = (
    "import os, resource as r, sys; r.setrlimit(getattr(r, sys.argv[1]), (int(sys.argv[2]) << 20,) * 2); "
    "os.execv(sys.executable, [sys.executable, *sys.argv[3:]])"
)
# Threads that call linear algebra at once, where nothing more may be had than they need besides.
LINEAR_ALGEBRA = """
import resource, sys, threading
import numpy as np
from scipy.linalg import lapack
from bowdenfit.inference.engines import memory
if sys.argv[1] == "take":
    memory.take_buffers()
matrices, together = [np.eye(300) for _ in range(memory.cores() + 2)], threading.Barrier(memory.cores() + 2)
def work(matrix, of_numpy):
    together.wait()
    for _ in range(200):
        np.linalg.cholesky(matrix) if of_numpy else lapack.dpotrf(matrix)
threads = [threading.Thread(target=work, args=(m, i == 0), daemon=True) for i, m in enumerate(matrices)]
threading.stack_size(1 << 18)
used = next(int(line.split()[1]) for line in open("/proc/self/status") if line.startswith("VmData")) << 10
resource.setrlimit(resource.RLIMIT_DATA, (used + (28 << 20) + len(threads) * (9 << 20),) * 2)
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
print("done")
"""
ABORTED = """
import os, sys
from pathlib import Path
from bowdenfit import cli
from bowdenfit.cli import supervised
def work():
    supervised.say_if_aborted(Path(sys.argv[2]), "It is kept.")
    os.write(2, b"LLVM ERROR: out of memory")
    if sys.argv[1] == "abort":
        os.abort()
    sys.exit(int(sys.argv[1]))
cli.main = work
cli.start()
"""


def limited(kind, mebibytes, *arguments, seconds=120):
    command = [sys.executable, "-c", LIMITED, kind, str(mebibytes), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=seconds)


@pytest.mark.parametrize(("kind", "limit"), [("RLIMIT_AS", 1500), ("RLIMIT_DATA", 500)])
def test_a_fit_under_too_low_a_limit_is_refused_at_the_start(on_body, tmp_path, kind, limit):
    done = limited(kind, limit, "-m", "bowdenfit.cli", "fit", on_body, "-o", tmp_path / "fit", "--seed", 3)
    assert done.returncode == 1
    assert done.stderr.startswith("Error: there are not the") and len(done.stderr.splitlines()) == 1
    assert not (tmp_path / "fit").exists()


@pytest.mark.skipif(sys.platform != "linux", reason="limits of data are Linux's")
def test_the_library_refuses_too_little_memory_too(tmp_path):
    recordings = "datasets/synthetic-recordings"  # whose fit by NUTS once waited for ever under this limit
    fit = f"import bowdenfit as bf; bf.fit({recordings!r}, sampler='nuts', output={str(tmp_path / 'fit')!r})"
    done = limited("RLIMIT_DATA", 700, "-c", fit)
    assert done.returncode == 1
    assert "MemoryShortageError: there are not the" in done.stderr.splitlines()[-1]
    assert not (tmp_path / "fit").exists()


@pytest.mark.skipif(sys.platform != "linux", reason="limits of data are Linux's")
def test_linear_algebra_asks_for_no_memory_once_it_has_its_buffers():
    done = subprocess.run(
        [sys.executable, "-c", LINEAR_ALGEBRA, "take"],
        env=os.environ | {"OPENBLAS_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        check=False,
        timeout=60,  # else it asks again and again
    )
    assert done.stdout == "done\n", done.stderr


@pytest.mark.skipif(sys.platform != "linux", reason="limits of data are Linux's")
@pytest.mark.parametrize(
    ("end", "kept", "code", "said"),
    [
        ("abort", ".", 1, "Error: memory ran out; close other programs, or run this where there is more of it. It is kept.\n"),
        ("abort", "x", 1, "Error: memory ran out; close other programs, or run this where there is more of it.\n"),
        ("3", ".", 3, ""),
        ("0", ".", 0, ""),
    ],
)
def test_a_library_that_aborts_under_a_limit_ends_with_a_sentence(end, kept, code, said):
    done = limited("RLIMIT_DATA", 4000, "-c", ABORTED, end, kept)
    assert (done.returncode, done.stderr) == (code, said)


def test_a_fit_that_runs_out_of_memory_while_it_samples_is_kept(tmp_path, monkeypatch):
    settings = {"sampler.max_steps": 400, "sampler.n_walkers": 32, "sampler.target_ess": 100}
    asked = {"settings": [f"{name}={value}" for name, value in settings.items()], "seed": 3, "figures": False}
    cable = "datasets/yarn-on-cylinder"
    whole = bf.fit(cable, **asked)

    def refuse(*_, **__):
        raise OSError(12, "Cannot allocate memory")

    def starve(progress):
        if progress.steps >= 200:
            monkeypatch.setattr(memory, "mmap", SimpleNamespace(mmap=refuse))

    with pytest.raises(MemoryShortageError, match="MiB of memory"):
        bf.fit(cable, output=tmp_path / "fit", progress=starve, **asked)
    monkeypatch.undo()
    resumed = bf.fit(cable, output=tmp_path / "fit", resume=True, **asked)
    assert resumed.posterior.z.tobytes() == whole.posterior.z.tobytes()


def _setting(name, **environment):
    """What the command line makes of a variable that is not set, or set so, and whether what computes is loaded by then."""
    program = (
        "import os, sys; from bowdenfit import cli; sys.argv = ['bowdenfit', '--version']; "
        f"os._exit = lambda code: print(os.environ[{name!r}], 'numpy' in sys.modules); cli.start()"
    )
    others = {other: value for other, value in os.environ.items() if other != name}
    done = subprocess.run(
        [sys.executable, "-c", program], env=others | environment, capture_output=True, text=True, check=False, timeout=60
    )
    return done.stdout.splitlines()[-1]


def test_the_command_line_lets_linear_algebra_take_no_memory_for_threads():
    assert _setting("OPENBLAS_NUM_THREADS") == "1 False"


def test_the_command_line_leaves_a_gpu_alone_unless_it_is_asked_for():
    assert _setting("JAX_PLATFORMS") == "cpu False"
    assert _setting("JAX_PLATFORMS", JAX_PLATFORMS="cuda,cpu") == "cuda,cpu False"
