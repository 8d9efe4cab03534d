"""Processes that are started here: they end with the one that started them, and leave interrupts to it."""

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager


def cores() -> int:
    """That this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def may_be_copied() -> bool:
    """Whether a copy of this process would work: of one that runs several threads only one is copied."""
    return sys.platform == "linux" and "jax" not in sys.modules and threading.active_count() == 1


@contextmanager
def meanwhile(function: Callable[[], object], in_background: bool) -> Iterator[None]:
    """A copy of this process calls a function while this one goes on; where that cannot be or fails, this one does then.

    Args:
        function: What it writes to files is all that is left of it.
        in_background: Whether there may be another process.
    """
    copy = _copy_that_calls(function) if in_background and cores() > 1 and may_be_copied() else None
    try:
        yield
        failed = copy is None or os.waitpid(copy, 0)[1] != 0
        copy = None
    finally:
        if copy is not None:
            os.kill(copy, signal.SIGKILL)
            os.waitpid(copy, 0)
    if failed:
        function()


def _copy_that_calls(function: Callable[[], object]) -> int | None:
    """The number of a process that ends with 0 where the function does not fail; None where none can be made."""
    try:
        number = os.fork()
    except OSError:
        return None
    if number:
        return number
    try:
        signal.set_wakeup_fd(-1)
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        function()
    except BaseException:
        os._exit(1)
    os._exit(0)


def start_worker(prepare: Callable[[], None]) -> None:
    """What a new process does first.

    Args:
        prepare: Called when it has been made sure that the process ends.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    end_with_parent()
    prepare()


def end_with_parent() -> None:
    """Let this process end as soon as the one that started it has ended, however that was."""
    from multiprocessing import connection, parent_process

    def wait() -> None:
        parent = parent_process()
        assert parent is not None  # this is a started process
        connection.wait([parent.sentinel])
        os._exit(1)

    threading.Thread(target=wait, daemon=True).start()


def settings_of_process(remember: bool) -> Callable[[], None]:
    """What a process that computes does first.

    Args:
        remember: Whether JAX may keep compiled programs in the user's cache folder.
    """
    return remember_compilations if remember else nothing


def remember_compilations() -> None:
    """Keep compiled programs in the user's cache folder, unless JAX has been told of another."""
    import jax
    from platformdirs import user_cache_dir

    if os.environ.get("JAX_COMPILATION_CACHE_DIR"):
        return
    jax.config.update("jax_compilation_cache_dir", user_cache_dir("bowdenfit"))
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.1)
    jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)


def nothing() -> None:
    """What is done first where nothing is."""
