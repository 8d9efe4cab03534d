"""Linear algebra in one thread, where threads of our own use every core already.

OpenBLAS shares even a 16 by 16 matrix out to threads of its own, which keep a core busy while they wait: 16 parameters took
twice as long to sample on two idle cores, and 3.6 times with another fit beside.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock
from typing import Any

_THREADS_VARIABLE = "OPENBLAS_NUM_THREADS"
_changing = Lock()
_limits: list[Any] = []  # the limit that is set, once for each that wants it


@contextmanager
def linear_algebra_in_one_thread() -> Iterator[None]:
    """Meanwhile NumPy, SciPy and what is compiled call it so, in the whole process.

    Afterwards it is as before; of several at a time the first sets the limit and the last takes it away.
    """
    if os.environ.get(_THREADS_VARIABLE) == "1":  # as the command line has it, from the start
        yield
        return
    import scipy.linalg.cython_lapack  # noqa: F401  (what compiled programs call, which has to be there to be told)
    from threadpoolctl import threadpool_limits

    with _changing:
        _limits.append(_limits[0] if _limits else threadpool_limits(1, user_api="blas"))
    try:
        yield
    finally:
        with _changing:
            limit = _limits.pop()
            if not _limits:
                limit.restore_original_limits()
