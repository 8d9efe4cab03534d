"""Processes that are started here: they end with the one that started them, and leave interrupts to it."""

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress


def cores() -> int:
    """That this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def may_be_copied() -> bool:
    """Whether a copy of this process would work: of one that runs several threads only one is copied."""
    return sys.platform == "linux" and "jax" not in sys.modules and threading.active_count() == 1


def has_room_beside() -> bool:
    """Whether a copy of this process would work, and on a core of its own."""
    return cores() > 1 and may_be_copied()


@contextmanager
def meanwhile(function: Callable[[], object]) -> Iterator[None]:
    """A copy of this process calls a function while this one goes on; what it fails at is done here afterwards.

    Args:
        function: What it writes to files is all that is left of it.
    """
    from multiprocessing import get_context

    copy = get_context("fork").Process(target=_work, args=(function,), daemon=True)
    with suppress(OSError):  # there may be no more processes
        copy.start()
    try:
        yield
        if copy.pid:
            copy.join()
        done = copy.exitcode == 0
    finally:
        if copy.pid:
            copy.kill()
            copy.join()
    if not done:
        function()


def _work(function: Callable[[], object]) -> None:
    """Of a copy: silent, since whoever made it says what goes wrong."""
    try:
        start_worker(function)
    except BaseException:
        os._exit(1)


def start_worker(prepare: Callable[[], object]) -> None:
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
