"""Ahead-of-time compilation with XLA options that suit small functions."""

from collections.abc import Callable
from concurrent.futures import Executor
from typing import Any

import jax

from bowdenfit.inference.resources import refuse_shortage

# Without XLA's newer fusion emitters the walkers of the on-body cable compile in 0.65 of the time (3.3 s instead of 5.0 s, with
# jaxlib 0.10); with them programs run in 0.65 to 1 of the time, which pays where running costs far more.
_OPTIONS: dict[str, Any] = {"xla_cpu_use_fusion_emitters": False}
_RUN_ONCE: dict[str, Any] = _OPTIONS | {"xla_backend_optimization_level": 0}
_RUN_OFTEN: dict[str, Any] = {"xla_cpu_use_fusion_emitters": True}


def compile_program(
    function: Callable[..., Any],
    *shapes: Any,
    run_once: bool = False,
    run_often: bool = False,
    beside: Executor | None = None,
) -> Callable[..., Any]:
    """Compile `function` for arguments of the given shapes.

    Args:
        run_once: Whether compiling costs more than running, so that optimization does not pay.
        run_often: Whether running costs far more than compiling.
        beside: Executor that compiles while this thread continues; the first call waits for it.

    Raises:
        MemoryShortageError: There is too little memory; the compiler itself would crash.
    """
    refuse_shortage()
    lowered = jax.jit(function).lower(*shapes)
    options = (_RUN_ONCE if run_once else _RUN_OFTEN if run_often else _OPTIONS) if jax.default_backend() == "cpu" else {}
    if beside is None:
        return _compile_lowered(lowered, options)
    compiled = beside.submit(_compile_lowered, lowered, options)
    return lambda *arguments: compiled.result()(*arguments)


def _compile_lowered(lowered: Any, options: dict[str, Any]) -> Callable[..., Any]:
    try:
        return lowered.compile(compiler_options=options)
    except jax.errors.JaxRuntimeError:  # options come and go from one version of XLA to the next
        return lowered.compile()
