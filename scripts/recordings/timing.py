"""The time of a call in this process."""

import time
from collections.abc import Callable
from typing import Any

import jax
import numpy as np


def milliseconds(function: Callable[..., Any], *arguments: Any, budget: float = 1.0) -> float:
    """Median time of a call [ms], after one that is not measured.

    Args:
        function: What to call; arrays of JAX that it returns are waited for.
        arguments: Its arguments.
        budget: Calls go on for so long [s]; there are at least three.
    """
    jax.block_until_ready(function(*arguments))
    times: list[float] = []
    while len(times) < 3 or (sum(times) < budget and len(times) < 1000):
        start = time.perf_counter()
        jax.block_until_ready(function(*arguments))
        times.append(time.perf_counter() - start)
    return 1000 * float(np.median(times))
