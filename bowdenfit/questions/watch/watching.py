"""Watch a bench: read and fit again whenever a row or a recording is complete, and say what is known."""

import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any

from bowdenfit.arguments import Length
from bowdenfit.dataset import Dataset
from bowdenfit.errors import BowdenfitError, DatasetError, DescriptionError, UsageError
from bowdenfit.inference.interval import Interval
from bowdenfit.inference.resources import keep_compiled_programs
from bowdenfit.kinds import find_readings
from bowdenfit.kinds.terms import find_term_kind
from bowdenfit.outputs import temporary_folder
from bowdenfit.questions.next.answer import TargetQuantity, choose_target
from bowdenfit.questions.next.candidates import rests_on_one_mounting
from bowdenfit.questions.next.ranking import is_good_enough, stopping_advice
from bowdenfit.questions.summary.verdict import assess_fit, distrust_warning
from bowdenfit.questions.watch.answer import History, UnreadableFiles, WatchedAnswer
from bowdenfit.questions.watch.files import BenchFiles
from bowdenfit.questions.watch.fitting import GrowingFit
from bowdenfit.reading import Reading, read
from bowdenfit.results.record import Record
from bowdenfit.units import route_conversion_factor
from bowdenfit.words import significant

POLL = 0.25  # s between two looks at the files


def watch_answers(
    path: Path,
    target_name: str | None = None,
    until: Length | None = None,
    reading: Reading | None = None,
    *,
    seed: int = 0,
    is_stopped: Callable[[], bool] = lambda: False,
    keep: Callable[[History], None] = lambda _: None,
) -> Iterator[WatchedAnswer | UnreadableFiles]:
    """Yield what is known of a cable whenever its files have a new complete row or recording, for ever.

    Each answer comes twice: at once with its interval (`trusted` is None), and once more when the verdict is worked out, unless
    more was measured meanwhile. A program with a page of its own iterates in a thread of its own:

        for answer in watch_answers(Path("my-cable"), until=(10, "mm"), is_stopped=closed.is_set):
            show(answer)  # a `WatchedAnswer`, or a `UnreadableFiles` where the files cannot be read as they are

    Args:
        path: Folder with a cable.toml, or one table or recording.
        target_name: What is to be known, as `next` takes it with `--for`; its default if omitted.
        until: Standard deviation to which it is to be known, in its unit or with a unit; then the iterator ends.
        reading: Keywords of `bowdenfit.read`.
        seed: Random seed.
        is_stopped: Asked between two looks at the files; the iterator ends where it returns True.
        keep: Called in a thread of its own with the history so far, after every verdict.

    Raises:
        DescriptionError: There is no such folder or file.
        UsageError: There is no such answer, or it cannot be known to what was asked for.
    """
    if not path.exists():
        raise DescriptionError(f"{path} does not exist; check the spelling and the folder.")
    keep_compiled_programs()
    join = (reading or {}).get("join")
    with temporary_folder() as copies, ThreadPoolExecutor(1) as assessing:
        files = BenchFiles(path, copies, None if join is None else Path(join))
        bench = _Bench(files, GrowingFit(seed), target_name, until, reading or {}, assessing, keep)
        while not is_stopped():
            for answer in bench.look():
                yield answer
                if until is not None and isinstance(answer, WatchedAnswer) and answer.may_stop and answer.trusted:
                    return
            time.sleep(POLL)


class _Bench:
    """A bench that is watched: its files, its fits, and what has been said."""

    def __init__(
        self,
        files: BenchFiles,
        fits: GrowingFit,
        target_name: str | None,
        until: Length | None,
        reading: Reading,
        assessing: ThreadPoolExecutor,
        keep: Callable[[History], None],
    ) -> None:
        self.files, self.fits, self.reading = files, fits, reading
        self.target_name, self.until, self.keep = target_name, until, keep
        self.assessing, self.history, self.refused = assessing, History(), ""
        self.latest: tuple[WatchedAnswer, Record] | None = None
        self.job: Future[tuple[WatchedAnswer, Record, WatchedAnswer]] | None = None
        self.is_assessed = True

    def look(self) -> Iterator[WatchedAnswer | UnreadableFiles]:
        """Look at the files once; yield what has become known."""
        if self.job is not None and self.job.done():
            before, fit, answer = self.job.result()
            self.job, self.history = None, self.history.add(answer)
            self.fits.release_programs(fit)
            if self.latest is not None and before is self.latest[0]:
                self.is_assessed = True
                yield answer
        if self.files.look(time.monotonic()):
            yield from self._read_and_fit()
        is_idle = self.job is None and not self.files.unsettled(time.monotonic())
        if is_idle and not self.is_assessed and self.latest is not None:
            self.job = self.assessing.submit(self._assess, *self.latest, self.history)

    def _read_and_fit(self) -> Iterator[WatchedAnswer | UnreadableFiles]:
        """Read what is settled, and fit it; what is missing while files change is waited for."""
        begin = time.perf_counter()
        try:
            dataset = self._read()
            if dataset is None:
                return
            fit = self.fits.draw(dataset)
        except (UsageError, MemoryError):
            raise
        except BowdenfitError as error:
            reason = str(error).replace(str(self.files.copy), str(self.files.path))
            if reason != self.refused and not self.files.unsettled(time.monotonic()):
                self.refused = reason
                yield UnreadableFiles(reason)
            return
        answer = self._describe(fit, time.perf_counter() - begin)
        self.refused, self.latest, self.is_assessed = "", (answer, fit), False
        self.history = self.history.add(answer)
        yield answer

    def _read(self) -> Dataset | None:
        """Return the data set; None where a file changed while it was read."""
        copy = self.files.copy_settled(time.monotonic())
        if copy is None:
            return None
        joined = self.files.joined_copy
        more: Any = {} if joined is None else {"join": joined}
        dataset = read(copy, **{**self.reading, **more})
        if self.files.is_unchanged():
            return dataset
        self.files.forget()
        return None

    def _describe(self, fit: Record, seconds: float) -> WatchedAnswer:
        """Return what a fit says of the quantity that is to be known."""
        target = choose_target(fit, self.target_name)
        may_stop, stop = self._judge(fit, target)
        return WatchedAnswer(
            fit.name, count_mountings(fit), sum(len(term.labels) for term in fit.model.terms),
            target.name, target.words, target.unit, Interval.of(target.draws), may_stop, stop,
            seconds=seconds, clock=f"{datetime.now():%H:%M:%S}",
        )  # fmt: skip

    def _judge(self, fit: Record, target: TargetQuantity) -> tuple[bool, str]:
        """Return whether enough is known, and a sentence that says so."""
        if rests_on_one_mounting(fit):
            return False, ""
        if self.until is None:
            is_enough = is_good_enough(fit, target)
            return is_enough, stopping_advice(fit, target) if is_enough else ""
        wanted = read_until(self.until, target)
        if target.sd > wanted:
            return False, ""
        unit = f" {target.unit}" if target.unit else ""
        known = f"{target.words} is known to ± {significant(target.sd, 2)}{unit}"
        return True, f"You may stop: {known}, and ± {wanted:g}{unit} was asked for."

    def _assess(self, answer: WatchedAnswer, fit: Record, history: History) -> tuple[WatchedAnswer, Record, WatchedAnswer]:
        """Return an answer as it was, its fit, and the answer with the verdict on that."""
        verdict = assess_fit(self.fits.complete(fit))
        assessed = replace(answer, troubles=dict(verdict.troubles), warning=distrust_warning(verdict), doubts=verdict.doubts)
        self.keep(history.add(assessed))
        return answer, fit, assessed


def count_mountings(fit: Record) -> int:
    """Return how many mountings a fit rests on: runs, and rows of efficiencies, which are one each."""
    return sum(
        len(term.labels)
        for term in fit.model.terms
        if find_term_kind(term.name).shows_mounting_scatter and (find_readings(term.name).are_runs or term.name == "efficiency")
    )


def read_until(until: Length, target: TargetQuantity) -> float:
    """Return a standard deviation that was asked for, in the unit of the quantity.

    Args:
        until: A number, or a number with its unit.
        target: The quantity.

    Raises:
        UsageError: It is not above 0, or has a unit that the quantity has not.
    """
    assert not isinstance(until, str)  # it has been read
    value, unit = (until, "") if isinstance(until, int | float) else until
    accepted = {"": 1.0, target.unit: 1.0} | ({"%": 1.0} if target.unit == "points" else {})
    if unit not in accepted:
        try:
            accepted[str(unit)] = route_conversion_factor(str(unit), target.unit)
        except DatasetError:
            example = f"in {target.unit}, such as --until 10{target.unit}"
            wanted = example if target.unit else "without a unit, such as --until 0.005"
            raise UsageError(f"--until {value:g}{unit}: {target.words} is known {wanted}.") from None
    if not float(value) > 0:
        raise UsageError(f"--until {value:g}{unit} must be above 0: it is the standard deviation that is good enough.")
    return float(value) * accepted[str(unit)]
