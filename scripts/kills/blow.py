"""One kill: what was struck when and how, and what came of it."""

import resource
import signal
from dataclasses import dataclass

from kills.jobs import Job

CALLED = ("starting", "compiling", "sampling", "writing")  # phases


@dataclass
class Blow:
    """One kill.

    Args:
        job: What is struck.
        sent: The signal; None for no memory.
        phase: Aimed at.
        moment: Seconds after the phase begins.
        memory: The limit that it runs under [bytes].
        struck: Phase that it was in; None where it was too late, or the limit was enough.
        report: How it ended and what came then.
        wrong: Which promise was broken.
    """

    job: Job
    sent: signal.Signals | None
    phase: int
    moment: float
    memory: int = resource.RLIM_INFINITY
    struck: int | None = None
    report: str = ""
    wrong: str = ""

    @property
    def starved(self) -> bool:
        """Whether it is by a limit."""
        return self.memory != resource.RLIM_INFINITY

    def __str__(self) -> str:
        case = self.sent.name if self.sent else f"{self.memory / 1e6:.0f} MB" if self.starved else "OOM killer"
        when = "too late" if self.struck is None else CALLED[self.struck]
        return f"{self.job.name:9s} {case:10s} {when:9s} {self.report}{self.wrong and f'; WRONG: {self.wrong}'}"
