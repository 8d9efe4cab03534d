"""Linear algebra in one thread, where threads of our own use every core already.

OpenBLAS shares even a 16 by 16 matrix out to threads of its own, which keep a core busy while they wait: 16 parameters took
twice as long to sample on two idle cores, and 3.6 times with another fit beside.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager

_ASKED = "OPENBLAS_NUM_THREADS"


@contextmanager
def linear_algebra_in_one_thread() -> Iterator[None]:
    """Meanwhile NumPy, SciPy and what is compiled call it so, in the whole process; afterwards as before."""
    if os.environ.get(_ASKED) == "1":  # as the command line has it, from the start
        yield
        return
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1, user_api="blas"):
        yield
