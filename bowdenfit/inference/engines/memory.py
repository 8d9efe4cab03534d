"""Memory is asked for before it is needed: compiled libraries that get none abort, or wait for ever, instead of saying so."""

import mmap
from functools import cache

from bowdenfit.errors import MemoryShortageError
from bowdenfit.inference.engines.processes import available_cores

COMPILATION_BYTES = 64 << 20  # bytes; what compiling a program, or a block of sampling, takes at a time
ENSEMBLES_AT_ONCE = 4  # threads at most that move ensembles of walkers
_NEEDED = 768 << 20  # bytes; a small fit by NUTS takes so much beside what is loaded by then
_BUFFER = 32 << 20  # bytes; OpenBLAS, behind NumPy, SciPy and XLA, takes one for each thread that calls it
_ADDRESSES, _ADDRESSES_PER_CORE = 1500 << 20, 150 << 20  # bytes; of threads and their heaps most is never used


def refuse_shortage(size: int = COMPILATION_BYTES, addresses: bool = False) -> None:
    """Stop where memory cannot be had.

    Args:
        size: How much [bytes].
        addresses: Whether it is addresses alone that are asked for, which take no memory.

    Raises:
        MemoryShortageError: The system refuses it.
    """
    kind = {"flags": mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS} if hasattr(mmap, "MAP_PRIVATE") else {}
    if addresses and hasattr(mmap, "PROT_READ"):
        kind["prot"] = mmap.PROT_READ
    try:
        mmap.mmap(-1, size, **kind).close()
    except OSError:
        raise MemoryShortageError(
            f"there are not the {size >> 20} MiB of memory that this takes; close other programs, or raise the limit "
            "(ulimit -d and -v show it, or the container's)."
        ) from None


@cache
def refuse_low_memory() -> None:
    """Stop before a process begins to compute for long, where a small fit would run out of memory.

    Raises:
        MemoryShortageError: The system refuses that much.
    """
    refuse_shortage(_NEEDED + (available_cores() + ENSEMBLES_AT_ONCE) * _BUFFER)
    refuse_shortage(_ADDRESSES + available_cores() * _ADDRESSES_PER_CORE, addresses=True)
