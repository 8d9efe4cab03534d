"""While something long runs: a bar that says where it stands, and an interrupt that keeps what is done."""

import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import click

if TYPE_CHECKING:
    from bowdenfit.inference.chain import Progress

INTERRUPTED = 130
Report: TypeAlias = Callable[..., None]


@contextmanager
def watched(kept: Path, bar: "AbstractContextManager[Report]", remark: str) -> "Iterator[Report]":
    """Gives what to call while something long runs; says how to go on when the user (or the system) stops it.

    An interrupt that arrives inside a callback of the garbage collector is lost: Python prints it and goes on. So it is
    remembered, not printed, and raised again by the next call.

    Args:
        kept: File that lets it go on later, if it is there by then.
        bar: Gives what shows the progress.
        remark: What to say then.
    """
    asked = threading.Event()

    def stop(*_: object) -> None:
        asked.set()
        raise KeyboardInterrupt

    printed = sys.unraisablehook

    def lost(what: "sys.UnraisableHookArgs") -> None:
        if not issubclass(what.exc_type, KeyboardInterrupt):
            printed(what)

    sys.unraisablehook = lost
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, stop)
    signal.signal(signal.SIGTERM, stop)
    try:
        with bar as show:

            def report(*progress: Any) -> None:
                if asked.is_set():
                    raise KeyboardInterrupt
                show(*progress)

            yield report
    except KeyboardInterrupt:
        if kept.exists():
            click.echo(f"\nInterrupted; {remark}: run the same command with --resume.", err=True)
            raise click.exceptions.Exit(INTERRUPTED) from None
        raise
    finally:
        sys.unraisablehook = printed


def watched_fit(folder: Path) -> "AbstractContextManager[Report]":
    """What to call while sampling.

    Args:
        folder: Results folder.
    """
    from bowdenfit.results.folder import CHAIN

    return watched(folder / CHAIN, _sampling_bar(), f"the checkpoint is kept in {folder}")


def watched_calibration(folder: Path) -> "AbstractContextManager[Report]":
    """What to call after each replication.

    Args:
        folder: Folder of the calibration.
    """
    from bowdenfit.questions.calibrate.store import REPLICATIONS

    return watched(folder / REPLICATIONS, _replication_bar(), f"what is done is kept in {folder}")


@contextmanager
def _sampling_bar() -> "Iterator[Callable[[Progress], None]]":
    """A bar with R-hat and effective sample size, on a terminal only."""
    if not sys.stderr.isatty():
        yield lambda _: None
        return
    from tqdm import tqdm

    with tqdm(unit="step", desc="sampling", leave=False, bar_format="{desc} {n_fmt} steps, {elapsed}{postfix}") as bar:

        def report(progress: "Progress") -> None:
            bar.n = progress.steps
            bar.set_description_str(f"sampling with {progress.sampler}", refresh=False)
            if progress.r_hat is not None and progress.ess is not None:
                bar.set_postfix_str(f"R-hat {progress.r_hat:.3f}, effective draws {progress.ess:.0f}", refresh=False)
            bar.refresh()

        yield report


@contextmanager
def _replication_bar() -> "Iterator[Callable[[int, int], None]]":
    """A bar of replications, on a terminal only."""
    if not sys.stderr.isatty():
        yield lambda *_: None
        return
    from tqdm import tqdm

    with tqdm(unit="replication", desc="calibrating", leave=False) as bar:

        def report(done: int, total: int) -> None:
            bar.total, bar.n = total, done
            bar.refresh()

        yield report
