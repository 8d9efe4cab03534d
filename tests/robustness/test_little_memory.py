"""Too little memory, or too few addresses: a sentence, since libraries crash or wait for ever; and what was done is kept."""

import os
import subprocess
import sys
from types import SimpleNamespace

import pytest

import bowdenfit as bf
from bowdenfit.errors import MemoryShortageError
from bowdenfit.inference import resources

pytestmark = pytest.mark.extended

LIMITED = (
    "import os, resource as r, sys; r.setrlimit(getattr(r, sys.argv[1]), (int(sys.argv[2]) << 20,) * 2); "
    "os.execv(sys.executable, [sys.executable, *sys.argv[3:]])"
)

def limited(kind, mebibytes, *arguments, seconds=120):
    command = [sys.executable, "-c", LIMITED, kind, str(mebibytes), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=seconds)


@pytest.mark.parametrize(("kind", "limit"), [("RLIMIT_AS", 1500), ("RLIMIT_DATA", 500)])
def test_a_fit_under_too_low_a_limit_is_refused_at_the_start(on_body, tmp_path, kind, limit):
    done = limited(kind, limit, "-m", "bowdenfit", "fit", on_body, "-o", tmp_path / "fit", "--seed", 3)
    assert done.returncode == 1
    assert done.stderr.startswith("Error: this takes") and len(done.stderr.splitlines()) == 1
    assert not (tmp_path / "fit").exists()


@pytest.mark.skipif(sys.platform != "linux", reason="limits of data are Linux's")
def test_the_library_refuses_too_little_memory_too(tmp_path):
    recordings = "datasets/synthetic-recordings"  # whose fit by NUTS once waited for ever under this limit
    fit = f"import bowdenfit as bf; bf.fit({recordings!r}, sampler='nuts', output={str(tmp_path / 'fit')!r})"
    done = limited("RLIMIT_DATA", 700, "-c", fit)
    assert done.returncode == 1
    assert "MemoryShortageError: this takes" in done.stderr.splitlines()[-1]
    assert not (tmp_path / "fit").exists()


def test_a_fit_that_runs_out_of_memory_while_it_samples_is_kept(tmp_path, monkeypatch):
    settings = {"sampler.max_steps": 400, "sampler.n_walkers": 32, "sampler.target_ess": 100}
    options = {"settings": [f"{name}={value}" for name, value in settings.items()], "seed": 3, "figures": False}
    cable = "datasets/yarn-on-cylinder"
    whole = bf.fit(cable, **options)

    def refuse(*_, **__):
        raise OSError(12, "Cannot allocate memory")

    def starve(progress):
        if progress.steps >= 200:
            monkeypatch.setattr(resources, "mmap", SimpleNamespace(mmap=refuse))

    with pytest.raises(MemoryShortageError, match="MiB of memory"):
        bf.fit(cable, output=tmp_path / "fit", progress=starve, **options)
    monkeypatch.undo()
    resumed = bf.fit(cable, output=tmp_path / "fit", resume=True, **options)
    assert resumed.posterior.z.tobytes() == whole.posterior.z.tobytes()


def _setting(name, **environment):
    """What the command line makes of a variable that is not set, or set so, and whether what computes is loaded by then."""
    program = (
        "import os, sys; from bowdenfit import cli; sys.argv = ['bowdenfit', '--version']\n"
        f"try: cli.start()\nexcept SystemExit: print(os.environ[{name!r}], 'numpy' in sys.modules)"
    )
    variables = {other: value for other, value in os.environ.items() if other != name}
    done = subprocess.run(
        [sys.executable, "-c", program], env=variables | environment, capture_output=True, text=True, check=False, timeout=60
    )
    return done.stdout.splitlines()[-1]


def test_the_command_line_lets_linear_algebra_take_no_memory_for_threads():
    assert _setting("OPENBLAS_NUM_THREADS") == "1 False"


def test_the_command_line_leaves_a_gpu_alone_unless_it_is_asked_for():
    assert _setting("JAX_PLATFORMS") == "cpu False"
    assert _setting("JAX_PLATFORMS", JAX_PLATFORMS="cuda,cpu") == "cuda,cpu False"
