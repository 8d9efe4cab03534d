"""The program `bowdenfit`, or `python -m bowdenfit`: an interrupt while it loads prints one line, no traceback."""

import sys

if __name__ == "__main__" and not sys.flags.safe_path:
    del sys.path[0]  # the working folder, where `-m` looks for modules first: what is there must not run

import os
import signal

_INTERRUPTED = 130  # exit code, as shells have it


def _end(*_: object) -> None:
    os.write(2, b"\nInterrupted.\n" if os.isatty(2) else b"Interrupted.\n")  # a terminal shows ^C before it
    os._exit(_INTERRUPTED)


def start() -> None:
    """Load the command line, which takes a moment, and run it."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # a shell may have made this deaf to interrupts
        signal.signal(signal.SIGINT, _end)  # until a command runs, and once it has ended
    from bowdenfit.cli import start as run

    run()


if __name__ == "__main__":
    start()
