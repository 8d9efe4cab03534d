"""While a fit runs: a bar that says where it stands, and an interrupt that keeps the checkpoint."""

import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from bowdenfit.inference.chain import Progress

INTERRUPTED = 130


@contextmanager
def watched(folder: Path) -> "Iterator[Callable[[Progress], None]]":
    """Gives what to call while sampling; says where the checkpoint is when the user (or the system) stops a fit.

    An interrupt that arrives inside a callback of the garbage collector is lost: Python prints it and goes on. So it is
    remembered, not printed, and raised again by the next call.

    Args:
        folder: Results folder.
    """
    from bowdenfit.results.folder import CHAIN

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
        with _progress_bar() as show:

            def report(progress: "Progress") -> None:
                if asked.is_set():
                    raise KeyboardInterrupt
                show(progress)

            yield report
    except KeyboardInterrupt:
        if (folder / CHAIN).exists():
            click.echo(
                f"\nInterrupted; the checkpoint is kept in {folder}: run the same command with --resume.", err=True
            )
            raise click.exceptions.Exit(INTERRUPTED) from None
        raise
    finally:
        sys.unraisablehook = printed


@contextmanager
def _progress_bar() -> "Iterator[Callable[[Progress], None]]":
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
