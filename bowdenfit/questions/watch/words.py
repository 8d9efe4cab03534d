"""What a terminal shows of a bench that is watched: one line a mounting."""

from collections.abc import Iterable, Iterator

from bowdenfit.questions.watch.answer import UnreadableFiles, WatchedAnswer
from bowdenfit.words import counted, filled, listed, significant

NOT_LOOKED_AT = "not checked, since more was measured"


def watch_lines(answers: Iterable[WatchedAnswer | UnreadableFiles], name: str) -> Iterator[str]:
    """Yield what to print, in pieces: of each number of mountings the answer at once, and behind it the verdict.

    Args:
        answers: Answers of `watch_answers`.
        name: Name of the folder or file.
    """
    yield f"Watching {name}; Ctrl-C ends it.\n"
    is_open, shown, open_readings, reasons, stop = False, (-1, -1), -1, tuple[str, ...](), ""
    for answer in answers:
        if isinstance(answer, UnreadableFiles):
            yield f"{_end(is_open)}{filled(answer.why)}\n"
            is_open = False
            continue
        count = (answer.mountings, 0 if answer.mountings else answer.readings)
        if answer.trusted is None and count == shown:
            continue  # more readings of the last mounting: its line is printed again with the verdict
        if answer.trusted is None or not is_open or answer.readings != open_readings:
            yield f"{_end(is_open)}{describe_answer(answer)}"
            is_open, shown, open_readings = True, count, answer.readings
        if answer.trusted is None:
            continue
        yield f"{describe_verdict(answer)}\n"
        is_open = False
        if (reason := tuple(one for some in (answer.troubles or {}).values() for one in some)) != reasons:
            yield from (filled(f"- {sentence}", "  ", hangs=True) + "\n" for sentence in reason)
            reasons = reason
        if answer.stop != stop:
            yield filled(answer.stop) + "\n" if answer.stop else ""
            stop = answer.stop
    yield _end(is_open)


def _end(is_open: bool) -> str:
    """Return the end of a line whose verdict did not come."""
    return f"{NOT_LOOKED_AT}\n" if is_open else ""


def describe_answer(answer: WatchedAnswer) -> str:
    """Return the beginning of a line: how many mountings, and the answer with its interval."""
    count = counted(answer.mountings, "mounting") if answer.mountings else counted(answer.readings, "reading")
    return f"{answer.clock}  {count}: {answer.words} {_interval(answer)}; "


def _interval(answer: WatchedAnswer) -> str:
    interval, digits = answer.interval, answer.interval.digits
    unit = " %" if answer.unit == "points" else f" {answer.unit}" if answer.unit else ""
    spread = f" {answer.unit}" if answer.unit else ""
    return (
        f"{interval.median:z.{digits}f}{unit} (90 % interval {interval.range_text(digits)}{unit}), "
        f"± {significant(interval.sd, 2)}{spread}"
    )


def describe_verdict(answer: WatchedAnswer) -> str:
    """Return the end of a line: whether the answer may be trusted."""
    if answer.warning:
        return answer.warning
    return f"trusted, but {listed(answer.doubts)}" if answer.doubts else "trusted"
