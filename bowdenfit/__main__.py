"""The program `bowdenfit`, or `python -m bowdenfit`: from its first moment on an interrupt is one line, and no traceback."""

import os
import signal

_INTERRUPTED = 130


def _interrupted(*_: object) -> None:
    os.write(2, b"\nInterrupted.\n")
    os._exit(_INTERRUPTED)


def start() -> None:
    """Load the command line, which takes a moment, and run it."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # a shell may have made this deaf to interrupts
        signal.signal(signal.SIGINT, _interrupted)  # until the command line listens, and once it no longer does
    from bowdenfit.cli import start as run

    run()


if __name__ == "__main__":
    start()
