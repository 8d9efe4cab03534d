"""The verb `watch`: read and fit again whenever a bench has measured."""

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Unpack

from cyclopts import Parameter

from bowdenfit.arguments import ANSWER, DATASET, HIDDEN, LENGTHS, PATH, Length, Output, Seed, read_first
from bowdenfit.errors import UsageError
from bowdenfit.inference.resources import refuse_low_memory
from bowdenfit.questions import watch as room
from bowdenfit.questions.writing import write_answer
from bowdenfit.reading import Reading
from bowdenfit.verb import Reply, Verb

if TYPE_CHECKING:
    from bowdenfit.questions.watch.answer import History, UnreadableFiles, WatchedAnswer

NAME = "history"


@read_first
def watch(
    dataset: Annotated["str | Path", DATASET, PATH],
    answer: Annotated[str | None, ANSWER] = None,
    until: Annotated[Length | None, Parameter(metavar="UNCERTAINTY"), LENGTHS] = None,
    *,
    output: Output = None,
    seed: Annotated[Seed, Parameter(show_default="0")] = None,
    is_stopped: Annotated[Callable[[], bool], HIDDEN] = lambda: False,
    **reading: Unpack[Reading],
) -> "Iterator[WatchedAnswer | UnreadableFiles]":
    """Read and fit a data set again whenever its files have a new complete row or recording, for ever.

    Args:
        dataset: Folder with a cable.toml, or one table or recording.
        answer: What is to be known: optimal-length, optimal-efficiency, efficiency@470, or a parameter such as mu1.
        until: Standard deviation to which it is to be known, such as 10mm; watching ends once it is and the fit may be
            trusted.
        output: Folder for the history as text, figure and JSON, which are written again after every verdict.
        seed: Random seed.
        is_stopped: Asked between two looks at the files; watching ends where it returns True.
        reading: Keywords of `bowdenfit.read`.

    Raises:
        DescriptionError: There is no such folder or file.
        UsageError: There is no such answer, or it cannot be known to what was asked for.
        StoreError: `output` cannot be written.
    """
    refuse_low_memory()
    wanted: Any = until
    if isinstance(wanted, list) and len(wanted) != 1:
        raise UsageError("--until is one standard deviation, such as 10mm; name one.")
    keep = partial(_keep, output) if output is not None else lambda _: None
    limit = wanted[0] if isinstance(wanted, list) else wanted
    return room.watch_answers(Path(dataset), answer, limit, reading, seed=seed or 0, is_stopped=is_stopped, keep=keep)


def _keep(output: str | Path, history: "History") -> None:
    write_answer(output, NAME, history, str(history) + "\n", {NAME: room.history_figure}, history.answers[-1].cable)


def _reply(answers: "Iterator[WatchedAnswer | UnreadableFiles]", options: dict[str, Any]) -> Reply:
    return Reply("", pieces=room.watch_lines(answers, options["dataset"].name))


VERB = Verb(
    watch,
    _reply,
    """Watch a bench: fit again whenever a row is complete.

    Whenever a file of DATASET has a new complete row or recording, everything is
    read and fitted again, and one line says how many mountings there are, the
    answer with its interval, and whether to trust it. Ctrl-C ends it.

    A row counts once its line has ended. A file that still changes is waited for:
    a short one for half a second, one that a logger writes for some seconds. Where
    something cannot be read, a sentence says what is wrong, and watching goes on.

    Once enough is known, a sentence says so: for the best length as next does; for
    anything with --until, once it is known that well, and then the command ends.
    """,
    json="",
)
