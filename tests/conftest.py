"""Settings of every test: 64-bit floats, strict promotion of types, and shapes checked at run time."""

import ctypes
import gc
import os
import shutil
import sys
import tempfile
from importlib.metadata import version
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PROGRAMS = "JAX_COMPILATION_CACHE_DIR"
# Tests compile many thousand small programs once, over which the newer fusion emitters of XLA take half as long again. Others
# of its versions end the process where they do not know a flag.
FLAGS = {"0.10.2": "--xla_cpu_use_fusion_emitters=false"}


def keep_what_is_compiled() -> str | None:
    """Let workers, and what tests start, load what another process has compiled: half of the tests' time otherwise.

    Returns:
        A folder for the programs of JAX that is new, if there is none yet.
    """
    if sys.dont_write_bytecode:  # the machine keeps sources clean, and every process compiles all libraries
        sys.dont_write_bytecode = False
        sys.pycache_prefix = str(ROOT / ".pytest_cache" / "compiled")
        os.environ["PYTHONPYCACHEPREFIX"] = sys.pycache_prefix
        os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # none after -B
    if version("jaxlib") in FLAGS:
        os.environ.setdefault("XLA_FLAGS", FLAGS[version("jaxlib")])
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line has it; workers have no cores to spare
    os.environ["JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS"] = "0"
    os.environ["JAX_PERSISTENT_CACHE_MIN_ENTRY_SIZE_BYTES"] = "-1"
    if PROGRAMS in os.environ:  # of the process that started this one, or of several runs one after the other
        return None
    os.environ[PROGRAMS] = tempfile.mkdtemp(prefix="bowdenfit-programs-")
    return os.environ[PROGRAMS]


NEW = keep_what_is_compiled()  # before anything large is loaded

from jaxtyping import install_import_hook  # noqa: E402

# The rooms whose functions are about arrays. They are loaded when they are first needed, so that the hook stays.
CHECKED = ("physics", "cable", "recordings", "kinds", "addons.device.mechanics")
install_import_hook([f"bowdenfit.{room}" for room in CHECKED], "type_checks.check")

import jax  # noqa: E402

import bowdenfit as bf  # noqa: E402
from bowdenfit import cli  # noqa: E402

jax.config.update("jax_enable_x64", True)
jax.config.update("jax_numpy_dtype_promotion", "standard")
gc.set_threshold(50_000)  # what is traced makes many small objects, over which searches for cycles took a twentieth of the time

QUICK = ("sampler.n_walkers=64", "sampler.target_ess=300", "sampler.target_r_hat=1.05", "sampler.max_steps=4000")
MOST_MEMORY = 3 * 2**30  # bytes of a process, beyond which it drops what it has compiled


def pytest_addoption(parser):
    """Let more and other cases be tried of what slow tests mangle, forge and kill at random."""
    options = parser.getgroup("cases at random, of slow tests in tests/robustness")
    options.addoption("--cases", type=int, help="how many each test tries; as many as it says if omitted")
    options.addoption("--first-case", type=int, help="number of the first, which decides it and all that follow")


def pytest_unconfigure():
    """Leave no programs behind."""
    if NEW is not None:
        shutil.rmtree(NEW, ignore_errors=True)


def is_large() -> bool:
    """Whether this process holds more memory than it should; on Linux alone, where what nobody uses is given back first."""
    pages = Path("/proc/self/statm")

    def held() -> int:
        return int(pages.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")

    if not pages.exists() or held() <= MOST_MEMORY:
        return False
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)  # of glibc, which else keeps what was freed
    if trim is not None:
        trim(0)
    return held() > MOST_MEMORY


@pytest.fixture(scope="module", autouse=True)
def bounded_memory():
    """Programs of earlier files go where a process has grown large: JAX would keep them all, several GiB by the end."""
    yield
    if is_large():
        jax.clear_caches()


@pytest.fixture(scope="session", autouse=True)
def options_for_many_cables():
    """Walkers of a batch are compiled as everything else is: over the few cables of a test no slower compiler pays.

    Yields:
        The options with which they are compiled for many.
    """
    from bowdenfit.inference import compilation

    with pytest.MonkeyPatch.context() as patched:
        options = compilation._RUN_OFTEN
        patched.setattr(compilation, "_RUN_OFTEN", compilation._OPTIONS)
        yield options


@pytest.fixture(scope="session")
def on_body() -> Path:
    """The data set of the on-body exoskeleton paper."""
    return ROOT / "datasets" / "on-body-exoskeleton"


@pytest.fixture(scope="session")
def finished(on_body, tmp_path_factory) -> tuple[bf.Fit, Path]:
    """A quick, converged fit of the on-body data, and the folder with all its results; no test changes either."""
    from fits import made_once, shared_folder

    def make(folder):
        bf.fit(on_body, output=folder, seed=11, settings=QUICK)

    folder = made_once(shared_folder(tmp_path_factory) / "on-body", make)
    return bf.load(folder), folder


@pytest.fixture(scope="session")
def quick_fit(finished) -> bf.Fit:
    """The quick fit, read back."""
    return finished[0]


@pytest.fixture(scope="session")
def quick_results(finished) -> Path:
    """The folder of the quick fit."""
    return finished[1]


@pytest.fixture(scope="module")
def chromium():
    """One browser for all tests of a file, which are skipped where there is none."""
    from offline_browser import browser

    with browser() as program:
        yield program


@pytest.fixture(scope="module")
def axe(tmp_path_factory):
    """The script of axe-core."""
    from app_in_browser import get_axe

    return get_axe(tmp_path_factory.mktemp("axe"))


@pytest.fixture(scope="session")
def loop_results(on_body, tmp_path_factory) -> Path:
    """The folder of a quick fit of the synthetic loop, without figures; no test changes it."""
    from fits import made_once, shared_folder

    quick = ("sampler.n_walkers=64", "sampler.target_ess=200", "sampler.target_r_hat=1.05", "sampler.max_steps=3000")

    def make(folder):
        bf.fit(on_body.with_name("synthetic-haptic-loop"), output=folder, seed=3, settings=quick, figures=False)

    return made_once(shared_folder(tmp_path_factory) / "loop", make)


@pytest.fixture(scope="session")
def least_squares_of(tmp_path_factory):
    """Least squares of a published data set, by its name; no test changes it."""
    from fits import least_squares_of

    return least_squares_of(tmp_path_factory)


@pytest.fixture(scope="session")
def on_body_squares(least_squares_of) -> bf.Fit:
    """Least squares of the on-body data."""
    return least_squares_of("on-body-exoskeleton")


@pytest.fixture(scope="session")
def bench() -> Path:
    """The plan of the synthetic bench."""
    return ROOT / "datasets" / "synthetic-bench" / "bench.toml"


@pytest.fixture
def cases(request):
    """Return the numbers of the cases at random that a slow test tries: the usual ones, or those of the options."""

    def choose(usual: range) -> range:
        first, count = (request.config.getoption(name) for name in ("--first-case", "--cases"))
        first = usual.start if first is None else first
        return range(first, first + (count or len(usual)))

    return choose


@pytest.fixture
def run(monkeypatch, capsys, request):
    """Run the command line in this process: exit code, standard output, standard error; a failed test shows them all."""

    def call(*arguments):
        monkeypatch.setattr(sys, "argv", ["bowdenfit", *map(str, arguments)])
        with pytest.raises(SystemExit) as stop:
            cli.main()
        printed = capsys.readouterr()
        message = f"{printed.out}{printed.err}Exit code {stop.value.code}."
        request.node.add_report_section("call", " ".join(sys.argv), message)
        return stop.value.code, printed.out, printed.err

    return call


@pytest.fixture
def refuse(run, tmp_path):
    """Run the command line on bad input, and return its sentences, one a fault; nothing may be written."""

    def call(*arguments, faults=1):
        files_at_start = sorted(tmp_path.rglob("*"))
        code, out, err = run(*arguments)
        assert code == 2, (out, err)
        assert out == ""
        assert err.startswith("Error: ")
        lines = err.splitlines()
        if faults > 1:
            assert lines.pop(0) == f"Error: {faults} things are wrong:"
            assert all(line.startswith("- ") for line in lines)
        assert len(lines) == faults, err
        assert all(len(line) < 520 for line in lines)
        assert all(line[-1] in ".?" for line in lines)
        assert "inside bowdenfit" not in err
        assert sorted(tmp_path.rglob("*")) == files_at_start
        return err

    return call


@pytest.fixture
def accept(run):
    """Run the command line on input that is good enough, and return what it prints."""

    def call(*arguments):
        code, out, err = run(*arguments)
        assert code == 0, (out, err)
        return out

    return call
