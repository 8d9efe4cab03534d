"""While something long runs: a bar that says where it stands, and an interrupt that keeps what is done."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeAlias

from bowdenfit.cli.interrupts import announce_continuation, refuse_interrupted
from bowdenfit.errors import DiskError, MemoryShortageError, system_error
from bowdenfit.inference.resources import refuse_low_memory
from bowdenfit.verb import Watch

Report: TypeAlias = Callable[..., None]


@contextmanager
def watch_verb(folder: Path | None, watch: Watch) -> Iterator[Report]:
    """Yield what to call while something long runs; say how to go on when the user (or the system) stops it.

    Args:
        folder: Results folder, where there is one.
        watch: What is kept there, and what the bar shows.

    Raises:
        MemoryShortageError: There is too little memory to begin.
        KeyboardInterrupt: The user stopped it; with how to go on, where something is kept.
    """
    refuse_low_memory()
    kept = folder / watch.kept if folder is not None and watch.kept else None

    def how_to_go_on() -> str:
        return f"{watch.remark} {folder}: run the same command with --resume" if kept is not None and kept.exists() else ""

    try:
        with announce_continuation(how_to_go_on), _bar(watch) as show:

            def report(*progress: Any) -> None:
                refuse_interrupted()
                show(*progress)

            yield report
            refuse_interrupted()
    except KeyboardInterrupt:
        raise KeyboardInterrupt(how_to_go_on()) from None
    except Exception as error:
        shortage = error if isinstance(error, DiskError) else system_error(error)
        if how_to_go_on() and isinstance(shortage, DiskError | MemoryShortageError):
            raise type(shortage)(
                f"{shortage} What was done so far is kept in {folder}: with room, run the same command with --resume."
            ) from None
        raise


@contextmanager
def _bar(watch: Watch) -> Iterator[Report]:
    """Show a bar, on a terminal only."""
    if not sys.stderr.isatty():
        yield lambda *_: None
        return
    from tqdm import tqdm

    with tqdm(leave=False, **watch.bar) as bar:
        yield lambda *progress: watch.show(bar, *progress)
