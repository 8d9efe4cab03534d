"""The program `bowdenfit`, or `python -m bowdenfit`: from its first moment on an interrupt is one line, and no traceback."""

import _signal as signal  # what the module `signal` is of, without what that loads: until then an interrupt is a traceback
import os

_INTERRUPTED = 130


def _interrupted(*_: object) -> None:
    os.write(2, b"\nInterrupted.\n" if os.isatty(2) else b"Interrupted.\n")  # a terminal shows ^C before it
    os._exit(_INTERRUPTED)


def start() -> None:
    """Load the command line, which takes a moment, and run it."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # a shell may have made this deaf to interrupts
        signal.signal(signal.SIGINT, _interrupted)  # until the command line listens, and once it no longer does
    from bowdenfit.cli import start as run

    run()


if __name__ == "__main__":
    start()
