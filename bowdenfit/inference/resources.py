"""Cores, memory and threads of this machine, and how worker processes start and end.

Memory is requested before it is needed, because compiled libraries that get none abort, or wait for ever, without a message.

Linear algebra runs in one thread where our own threads use every core already: OpenBLAS splits even a 16 by 16 matrix among
threads of its own, which keep a core busy while they wait. With 16 parameters sampling took twice as long on two idle cores,
and 3.6 times as long beside another fit.
"""

import mmap
import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from multiprocessing import connection, parent_process
from threading import Lock
from typing import Any

from platformdirs import user_cache_dir
from threadpoolctl import threadpool_limits

from bowdenfit.child_process import ignore_local_settings
from bowdenfit.errors import MemoryShortageError

COMPILATION_BYTES = 64 << 20  # bytes that compiling a program, or a block of sampling, takes at a time
ENSEMBLES_AT_ONCE = 4  # most threads that move ensembles of walkers
_NEEDED = 768 << 20  # bytes that a small fit by NUTS takes beside what is loaded by then
_BUFFER = 32 << 20  # bytes; OpenBLAS, behind NumPy, SciPy and XLA, allocates one buffer for each calling thread
# bytes of address space; most of what threads and their heaps reserve is never used
_ADDRESSES, _ADDRESSES_PER_CORE = 1500 << 20, 150 << 20
_THREADS_VARIABLE = "OPENBLAS_NUM_THREADS"
_changing = Lock()
_limits: list[Any] = []  # the limit in force, once for each caller that wants it


def available_cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def start_worker() -> None:
    """Prepare a worker process: it ignores interrupts, and ends when the process that started it ends, however that ends."""
    ignore_local_settings()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    parent = parent_process()
    assert parent is not None  # this is a started process

    def end_with_parent() -> None:
        connection.wait([parent.sentinel])
        os._exit(1)

    threading.Thread(target=end_with_parent, daemon=True).start()
    keep_compiled_programs()


@cache
def keep_compiled_programs() -> None:
    """Make JAX keep compiled programs in the user's cache folder for later processes. This is a setting of the whole process.

    JAX_COMPILATION_CACHE_DIR names another folder, and JAX_ENABLE_COMPILATION_CACHE=false turns this off; so does what the
    program has set by `jax.config`.
    """
    import jax
    settings: Any = jax.config
    if settings.jax_compilation_cache_dir or not settings.jax_enable_compilation_cache:
        return
    jax.config.update("jax_compilation_cache_dir", user_cache_dir("bowdenfit"))
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.1)
    jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)


def refuse_shortage(size: int = COMPILATION_BYTES, addresses: bool = False) -> None:
    """Raise an error where memory cannot be had.

    Args:
        size: How much is needed [bytes].
        addresses: Whether only address space is needed, which takes no memory.

    Raises:
        MemoryShortageError: The system refuses it.
    """
    kind: dict[str, Any] = {"flags": mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS} if hasattr(mmap, "MAP_PRIVATE") else {}
    if addresses and hasattr(mmap, "PROT_READ"):
        kind["prot"] = mmap.PROT_READ
    try:
        mmap.mmap(-1, size, **kind).close()
    except OSError:
        raise MemoryShortageError(
            f"this takes {size >> 20} MiB of memory, which are not free; close other programs, or raise the limit "
            "(ulimit -d and -v show it, or the container's)."
        ) from None


@cache
def refuse_low_memory() -> None:
    """Raise an error before a long computation starts where a small fit would run out of memory.

    Raises:
        MemoryShortageError: The system refuses that much.
    """
    refuse_shortage(_NEEDED + (available_cores() + ENSEMBLES_AT_ONCE) * _BUFFER)
    refuse_shortage(_ADDRESSES + available_cores() * _ADDRESSES_PER_CORE, addresses=True)


@contextmanager
def linear_algebra_in_one_thread() -> Iterator[None]:
    """Restrict BLAS of NumPy, SciPy and compiled programs to one thread, in the whole process, during a `with` block.

    Blocks may overlap: the first sets the limit and the last removes it.
    """
    if os.environ.get(_THREADS_VARIABLE) == "1":  # as the command line has it, from the start
        yield
        return
    import scipy.linalg.cython_lapack  # noqa: F401  (what compiled programs call, which has to be there to be told)
    with _changing:
        _limits.append(_limits[0] if _limits else threadpool_limits(1, user_api="blas"))
    try:
        yield
    finally:
        with _changing:
            limit = _limits.pop()
            if not _limits:
                limit.restore_original_limits()
