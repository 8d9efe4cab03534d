"""The command line: arguments in, exit code out."""

import os
import re
import sys
import warnings
from contextlib import suppress
from pathlib import Path
from typing import NoReturn

from cyclopts import CycloptsError

from bowdenfit.child_process import ignore_local_settings
from bowdenfit.cli.commands import bowdenfit, describe_error
from bowdenfit.cli.running import INTERRUPTED, requested, run_interruptibly
from bowdenfit.cli.terminal import NoReaderError, say, say_interrupted
from bowdenfit.errors import BowdenfitError, UsageError, describe_unforeseen, system_error
from bowdenfit.extensions import list_problems
from bowdenfit.words import few

_NEW_LINE = re.compile(r"[\r\n](?!- )")  # in the name of a file: our own sentences have new lines before "- " alone
_NO_READER = 141  # exit code, as shells have it of a process whose output nobody reads on
_OF_LIBRARIES = ("JAX_", "XLA_", "MPL", "OMP_")  # what the variables begin with that tell them what to do
_HARMLESS = {("JAX_PLATFORMS", "cpu"), ("OMP_NUM_THREADS", "1")}


def start() -> None:
    """Run the program: `main`, in surroundings that suit a command."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # it takes 32 MiB a thread when loaded, and waits for ever if it may not
    os.environ.setdefault("JAX_PLATFORMS", "cpu")  # a GPU takes 1.5 to 1.9 times as long for a fit, and most of its memory
    os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")  # XLA says on stderr where a busy machine compiles slowly
    if not (sys.warnoptions or os.environ.get("BOWDENFIT_DEBUG")):
        # Python frees the semaphores of helpers that were ended, and would say so below our own words.
        os.environ.setdefault("PYTHONWARNINGS", "ignore:resource_tracker")
        warnings.simplefilter("ignore")  # of libraries, in words of their own; what matters is said in ours
    _open_what_is_closed()
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:  # closed by whoever started this
            setattr(sys, name, Path(os.devnull).open("w", encoding="utf-8"))  # noqa: SIM115  (for as long as this runs)
    ignore_local_settings()
    main()


def _open_what_is_closed() -> None:
    """Open standard streams that are closed, so that no later file takes their number, to which libraries print."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # which takes the first number that is free


def main() -> None:
    """Run the command line; every error the user can cause is a sentence and an exit code."""
    try:
        code = run_interruptibly(lambda: bowdenfit(sys.argv[1:])) or (0 if sys.argv[1:] else UsageError.exit_code)
        sys.exit(code)
    except CycloptsError as error:
        _print_error(f"Error: {describe_error(error)}")
        sys.exit(UsageError.exit_code)
    except BowdenfitError as error:
        _print_error(f"Error: {_NEW_LINE.sub('?', str(error))}")
        sys.exit(error.exit_code)
    except KeyboardInterrupt as stop:
        _end_interrupted(*stop.args)
    except NoReaderError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(_NO_READER)
    except Exception as error:
        if requested.is_set():  # whatever came of it is that interrupt
            _end_interrupted()
        if os.environ.get("BOWDENFIT_DEBUG"):
            raise
        error.__traceback__ = None  # what they hold may be all the memory there is
        refused = system_error(error)
        _print_error(f"Error: {refused or describe_unforeseen(error, _suggest_remedy())}")
        sys.exit(refused.exit_code if refused else 1)
    finally:
        for problem in list_problems():
            _print_error(f"Warning: {_NEW_LINE.sub('?', problem)}")


def _suggest_remedy() -> str:
    """Return what to do about an unforeseen error; environment variables that configure libraries may be the cause."""
    report = "please report it with what BOWDENFIT_DEBUG=1 prints when you run the command again."
    settings = [name for name, value in os.environ.items() if name.startswith(_OF_LIBRARIES) and (name, value) not in _HARMLESS]
    if not settings:
        return f"This is our fault: {report}"
    them = "it" if len(settings) == 1 else "them"
    return (
        f"{few(settings)} in the environment may be the cause: unset {them}, and run the command again. If that does not help, "
        f"this is our fault: {report}"
    )


def _print_error(text: str) -> None:
    """Print what went wrong, if standard error is open; the exit code tells it in any case."""
    with suppress(OSError):
        say(text, err=True)


def _end_interrupted(how_to_go_on: str = "") -> NoReturn:
    with suppress(OSError):
        say_interrupted(how_to_go_on)
    sys.exit(INTERRUPTED)
