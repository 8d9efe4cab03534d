"""Compiling ahead of time, with what makes it quick for functions this small."""

from collections.abc import Callable
from concurrent.futures import Executor
from functools import cache
from typing import Any

import jax
import jax.numpy as jnp

from bowdenfit.inference.engines.memory import refuse_shortage

# Measured on two cores: whole vectors of 512 bits run in 0.85 to 1 of the time and compile no longer. XLA's newer fusion
# emitters take twice as long to compile the small elementwise functions here, which then run in 0.65 to 1 of the time. YNNPACK,
# which it hands products and sums to, takes longer to call than these small ones to work out: without it walkers move in 0.73
# to 1 of the time.
_OPTIONS: dict[str, Any] = {
    "xla_cpu_use_fusion_emitters": False,
    "xla_cpu_parallel_codegen_split_count": 2,
    "xla_cpu_prefer_vector_width": 512,
    "xla_cpu_experimental_ynn_fusion_type": "",
}
_RUN_ONCE: dict[str, Any] = _OPTIONS | {"xla_backend_optimization_level": 0}
_RUN_OFTEN: dict[str, Any] = _OPTIONS | {"xla_cpu_use_fusion_emitters": True}


def compile_program(
    function: Callable[..., Any],
    *shapes: Any,
    run_once: bool = False,
    run_often: bool = False,
    beside: Executor | None = None,
) -> Callable[..., Any]:
    """`function` compiled for arguments of the given shapes.

    Args:
        run_once: Whether compiling costs more than running, so that optimization does not pay.
        run_often: Whether running costs far more than compiling.
        beside: Compiles it while this thread goes on; the first call waits for that.

    Raises:
        MemoryShortageError: There is too little memory for it, which the compiler cannot say.
    """
    refuse_shortage()
    lowered = jax.jit(function).lower(*shapes)
    options = (_RUN_ONCE if run_once else _RUN_OFTEN if run_often else _OPTIONS) if jax.default_backend() == "cpu" else {}
    if beside is None:
        return _compiled(lowered, options)
    compiled = beside.submit(_compiled, lowered, options)
    return lambda *arguments: compiled.result()(*arguments)


def _compiled(lowered: Any, options: dict[str, Any]) -> Callable[..., Any]:
    try:
        return lowered.compile(compiler_options=options)
    except jax.errors.JaxRuntimeError:  # perhaps of an option that this XLA does not have
        return lowered.compile(compiler_options={name: value for name, value in options.items() if _known(name, value)})


@cache
def _known(name: str, value: Any) -> bool:
    """Whether the installed XLA has an option; they come and go from one version to the next."""
    try:
        jax.jit(lambda x: x).lower(jnp.zeros(())).compile(compiler_options={name: value})
    except jax.errors.JaxRuntimeError:
        return False
    return True
