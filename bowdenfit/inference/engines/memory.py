"""Memory is asked for before it is needed: compiled libraries that get none abort, or wait for ever, instead of saying so.

OpenBLAS, behind LAPACK in NumPy, SciPy and XLA, takes a buffer for each thread that calls it, at the first call that finds no
free one, and where the system refuses it asks again without end. So all that can be needed are taken before anything is
computed, when a refusal is still a sentence.
"""

import mmap
from collections.abc import Callable
from contextlib import suppress
from ctypes import CDLL, c_int, c_void_p
from functools import cache
from importlib import import_module
from sys import modules

from bowdenfit.errors import MemoryShortageError
from bowdenfit.inference.engines.processes import cores

AT_ONCE = 64 << 20  # bytes; what compiling a program, or a block of sampling, takes at a time
_BUFFER = 32 << 20  # bytes; one of OpenBLAS
ENSEMBLES_AT_ONCE = 4  # threads at most that move ensembles of walkers
_OF_PYTHON = 3  # threads at most that call one besides
_NEEDED = 576 << 20  # bytes; a small fit by NUTS takes so much beside what is loaded by then and these buffers
_ADDRESSES, _ADDRESSES_PER_CORE = 1500 << 20, 150 << 20  # bytes; of threads and their heaps most is never used
# Modules that bring one, and whether threads of XLA call it too.
_MODULES = {"numpy.linalg._umath_linalg": False, "scipy.linalg.cython_lapack": True}


def refuse_shortage(size: int = AT_ONCE, addresses: bool = False) -> None:
    """Stop where memory cannot be had.

    Args:
        size: How much [bytes].
        addresses: Whether it is addresses alone that are asked for, which take no memory.

    Raises:
        MemoryShortageError: The system refuses it.
    """
    kind = {"flags": mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS} if hasattr(mmap, "MAP_PRIVATE") else {}
    if addresses:
        kind["prot"] = mmap.PROT_READ
    try:
        mmap.mmap(-1, size, **kind).close()
    except OSError:
        raise MemoryShortageError(
            f"there are not the {size >> 20} MiB of memory that this takes; close other programs, or raise the limit "
            "(ulimit -d and -v show it, or the container's)."
        ) from None


@cache
def refuse_too_little() -> None:
    """Stop before a process begins to compute for long, where a small fit would run out of memory.

    Raises:
        MemoryShortageError: The system refuses that much.
    """
    refuse_shortage(_NEEDED + (2 * _OF_PYTHON + _of_programs()) * _BUFFER)
    refuse_shortage(_ADDRESSES + cores() * _ADDRESSES_PER_CORE, addresses=True)


def take_buffers(loaded: bool = False) -> None:
    """Let linear algebra have the memory that it will want in this process, so that no call of it waits for some.

    Args:
        loaded: Whether to pass over what nothing has loaded yet; JAX loads SciPy's, which takes half a second, when it lowers
            a function that needs it.

    Raises:
        MemoryShortageError: The system refuses it.
    """
    for name in _MODULES:
        if not loaded or name in modules:
            _take_buffers_of(name)


@cache
def _take_buffers_of(name: str) -> None:
    """Take those of one module, once."""
    with suppress(AttributeError):  # of another library than OpenBLAS, or one that keeps this to itself
        library = CDLL(import_module(name).__file__)
        take, give = library.blas_memory_alloc, library.blas_memory_free
        take.argtypes, take.restype, give.argtypes, give.restype = [c_int], c_void_p, [c_void_p], None
        _take(take, give, _OF_PYTHON + _MODULES[name] * _of_programs())


def _of_programs() -> int:
    """Threads that run what is compiled: of XLA, and those that move ensembles."""
    return cores() + min(cores(), ENSEMBLES_AT_ONCE)


def _take(take: Callable[[int], int | None], give: Callable[[int], None], count: int) -> None:
    """Have so many buffers at a time; the library keeps what is given back."""
    held = list[int]()
    try:
        for _ in range(count):
            refuse_shortage(_BUFFER)
            buffer = take(0)
            if buffer is None:
                return
            held.append(buffer)
    finally:
        for buffer in held:
            give(buffer)
