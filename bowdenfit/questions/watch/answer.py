"""What is known after so many mountings, as plain data: the answer with its interval, the verdict, and whether to stop."""

from dataclasses import dataclass
from typing import ClassVar

from bowdenfit.display import Block, Display, ResultTable, Rows, blocks_of, separate
from bowdenfit.inference.interval import Interval
from bowdenfit.words import begin_sentence, counted, significant


@dataclass(frozen=True, repr=False)
class UnreadableFiles(Display):
    """Files that cannot be read as they are now; they are watched on.

    Args:
        why: Faults, in sentences with a fix.
    """

    why: str

    def sentences(self) -> list[str]:
        """Return what is wrong."""
        return [self.why]


@dataclass(frozen=True, repr=False)
class WatchedAnswer(Display):
    """What is known after so many mountings.

    Args:
        cable: Name of the cable.
        mountings: How many mountings there are; 0 where nothing that was measured is mounted anew.
        readings: How many readings the fit has.
        name: The quantity that is to be known, as `--for` takes it.
        words: The same in a sentence.
        unit: Its unit; empty without one.
        interval: Its draws in short.
        may_stop: Whether enough is known: what was asked for, or else what `next` calls good enough.
        stop: The same in a sentence; empty where more needs to be measured.
        troubles: Why the fit must not be trusted, in sentences, by kind of trouble; None until that has been looked at.
        warning: What `summary` says first of a fit that must not be trusted; else empty.
        doubts: Weak evidence against a fit that may be trusted.
        seconds: Time to read and fit, once the files were settled [s].
        clock: Time of day at which it was known.
    """

    cable: str
    mountings: int
    readings: int
    name: str
    words: str
    unit: str
    interval: Interval
    may_stop: bool
    stop: str
    troubles: dict[str, tuple[str, ...]] | None = None
    warning: str = ""
    doubts: tuple[str, ...] = ()
    seconds: float = 0.0
    clock: str = ""

    JSON: ClassVar = (..., "trusted")

    @property
    def trusted(self) -> bool | None:
        """Whether the fit may be trusted; None until that has been looked at."""
        return None if self.troubles is None else not self.troubles


@dataclass(frozen=True, repr=False)
class History(Display):
    """How an answer became known: one entry for each number of mountings, the last that was known of it.

    Args:
        answers: In the order of the mountings.
    """

    answers: tuple[WatchedAnswer, ...] = ()

    def sentences(self) -> list[str]:
        """Return what is known now, and from how many mountings."""
        if not self.answers:
            return ["Nothing has been fitted yet."]
        last = self.answers[-1]
        unit = f" {last.unit}" if last.unit else ""
        return [f"{begin_sentence(last.words)} after {counted(last.mountings, 'mounting')}: {last.interval}{unit}."]

    def add(self, answer: WatchedAnswer) -> "History":
        """Return the history with an answer in place of an earlier one of as many mountings."""
        remaining = [one for one in self.answers if _count(one) != _count(answer)]
        return History(tuple(sorted([*remaining, answer], key=_count)))

    def _table(self) -> Rows:
        rows = [
            {"mountings": one.mountings, "readings": one.readings, "quantity": one.name}
            | vars(one.interval)
            | {"trusted": one.trusted, "may_stop": one.may_stop}
            for one in self.answers
        ]
        unit = self.answers[-1].unit or "1" if self.answers else "1"
        return rows, dict.fromkeys(("mean", "sd", "median", "q05", "q95"), unit)


@blocks_of.register
def _(history: History) -> list[Block]:
    """Return the history as a table, and what is known at its end."""
    heads = ["mountings", "readings", "answer", "90 % interval", "±", "verdict", "enough"]
    verdicts = {None: "not checked", True: "trusted", False: "DO NOT USE"}
    rows = [
        [
            str(one.mountings), str(one.readings), f"{one.interval.median:z.{one.interval.digits}f}",
            one.interval.range_text(one.interval.digits), significant(one.interval.sd, 2),
            verdicts[one.trusted], "yes" if one.may_stop else "no",
        ]
        for one in history.answers
    ]  # fmt: skip
    stop = history.answers[-1].stop if history.answers else ""
    return separate(*([sentence] for sentence in history.sentences()), [ResultTable(heads, rows)] if rows else [], [stop])


def _count(answer: WatchedAnswer) -> tuple[int, int]:
    """Return what answers are told apart by: mountings, or readings where nothing is mounted anew."""
    return answer.mountings, 0 if answer.mountings else answer.readings
