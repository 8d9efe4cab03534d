"""Print to a terminal: in Unicode, or in ASCII where the terminal has nothing else."""

import os
import sys

from bowdenfit.words import in_ascii, printable


class NoReaderError(OSError):
    """The program that reads the output has ended, as `head` does after some lines."""


def say(text: str, err: bool = False, nl: bool = True) -> None:
    """Print to standard output, or to standard error.

    Args:
        text: Text to print.
        err: Whether it goes to standard error.
        nl: Whether the line ends after it.

    Raises:
        NoReaderError: Nobody reads it.
    """
    stream = sys.stderr if err else sys.stdout
    printed = printable(text)
    try:
        stream.write((printed if can_show(printed, getattr(stream, "encoding", None)) else in_ascii(printed)) + "\n" * nl)
        stream.flush()
    except BrokenPipeError:
        raise NoReaderError from None


def say_interrupted(how_to_go_on: str = "") -> None:
    """Print in one line that this was interrupted; a terminal shows ^C before it.

    Args:
        how_to_go_on: Behind a semicolon, where something is kept.
    """
    apart = "\n" if sys.stderr is not None and sys.stderr.isatty() else ""
    say(f"{apart}Interrupted{how_to_go_on and f'; {how_to_go_on}'}.", err=True)


def can_show(text: str, encoding: str | None) -> bool:
    """Whether a terminal of an encoding can show a text; one of the locale C says that it has no more than ASCII.

    Args:
        text: Text to show.
        encoding: Encoding of the stream.
    """
    if os.environ.get("LC_ALL") in {"C", "POSIX"}:
        return text.isascii()
    try:
        text.encode(encoding or "ascii")
    except (UnicodeEncodeError, LookupError):
        return False
    return True
