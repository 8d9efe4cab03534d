"""Processes that are started here: they end with the one that started them, and leave interrupts to it."""

import os
import signal
import threading
from functools import cache
from typing import Any


def available_cores() -> int:
    """That this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def start_worker() -> None:
    """Prepare a new process: interrupts are for the one that started it, and it ends with that one, however that ends."""
    from multiprocessing import connection, parent_process

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
    """Have JAX keep compiled programs in the user's cache folder, for the next process; a setting of this whole process.

    JAX_COMPILATION_CACHE_DIR names another folder, and JAX_ENABLE_COMPILATION_CACHE=false turns this off; so does what the
    program has set by `jax.config`.
    """
    import jax
    from platformdirs import user_cache_dir

    settings: Any = jax.config
    if settings.jax_compilation_cache_dir or not settings.jax_enable_compilation_cache:
        return
    jax.config.update("jax_compilation_cache_dir", user_cache_dir("bowdenfit"))
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.1)
    jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)
