"""What long work shows of itself: on a terminal one line with stage and clock, and with `--verbose` a line for each stage."""

import logging
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from tqdm import tqdm

from bowdenfit.cli.terminal import say
from bowdenfit.stage_bar import DELAY, Report, Watch, follow_stages, stage_options
from bowdenfit.stages import LOGGER


@contextmanager
def show_stages(watch: Watch | None) -> Iterator[Report]:
    """Yield what a verb calls with its progress; on a terminal, show that and the stages that are announced meanwhile.

    Args:
        watch: Bar and interrupts of a verb; None if it has none.
    """
    if not sys.stderr.isatty() or LOGGER.isEnabledFor(logging.INFO):  # nobody looks, or --verbose prints them
        yield lambda *_: None
        return
    with tqdm(leave=False, delay=DELAY, **stage_options(watch)) as bar:
        try:
            with follow_stages(bar, watch) as line:
                yield line.show_progress
        finally:
            bar.clear()


def say_beside_stages(sentence: str) -> None:
    """Print a sentence on standard error, above the line with the stage where there is one."""
    with tqdm.external_write_mode(file=sys.stderr):
        say(sentence, err=True)


@contextmanager
def above_stages() -> Iterator[None]:
    """Let what is printed on standard output stand above the line with the stage, where there is one."""
    with tqdm.external_write_mode(file=sys.stdout):
        yield


def print_stages() -> None:
    """Print every stage on standard error from now on, with the time of day."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(logging.Formatter("%(asctime)s %(message)s", "%H:%M:%S"))
    LOGGER.addHandler(handler)
    LOGGER.setLevel(logging.INFO)
    LOGGER.propagate = False
