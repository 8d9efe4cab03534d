"""A fit that runs, or has ended, as pages show it."""

import json
import subprocess
import threading
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bowdenfit.child_process import python_command, safe_environment
from bowdenfit.results.folder import CHAIN, FIT, remove_empty_results

_PATIENCE = 5.0  # s, in which a process ends after it was told; a judgement


@dataclass(frozen=True)
class FitRequest:
    """What is to be fitted.

    Args:
        dataset: The data set.
        output: Its results folder.
        seed: Random seed; None for one that is drawn, and recorded.
        mcmc: Whether the posterior is sampled.
        resume: Whether an interrupted fit goes on.
        force: Whether an earlier fit in the folder is replaced.
        settings: Settings that differ from cable.toml, such as "friction.mu1.fixed=0.1".
        start: Values at which the search begins too, by parameter.
    """

    dataset: Path
    output: Path
    seed: int | None = None
    mcmc: bool = True
    resume: bool = False
    force: bool = False
    settings: tuple[str, ...] = ()
    start: Mapping[str, float] | None = None

    def to_json(self) -> dict[str, Any]:
        """Return the keywords of `bowdenfit.fit`."""
        return vars(self) | {"dataset": str(self.dataset), "output": str(self.output)}


class FitJob:
    """A fit in a process of its own, followed by a thread.

    Args:
        request: Data set, settings and seed to fit.
    """

    def __init__(self, request: FitRequest) -> None:
        self.request, self.stage, self.progress = request, "starting", ""
        self.notes: list[str] = []
        self.refusal, self.trusted, self.cancelled = "", None, False  # type: str, bool | None, bool
        self._began, self._ended = time.monotonic(), None  # type: float, float | None
        self._process = subprocess.Popen(  # noqa: S603  (our own)
            python_command("bowdenfit.addons.app.fit_process:main"), env=safe_environment(),
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, encoding="utf-8",
        )  # fmt: skip
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps(request.to_json()) + "\n")
        self._process.stdin.flush()
        threading.Thread(target=self._follow, daemon=True).start()

    @property
    def running(self) -> bool:
        """Whether it has not ended."""
        return self._ended is None

    @property
    def is_void(self) -> bool:
        """Whether it was cancelled before sampling, so that its folder holds nothing of a fit."""
        return self.cancelled and not self.running and not any((self.request.output / name).exists() for name in (CHAIN, FIT))

    @property
    def seconds(self) -> float:
        """How long it has run."""
        return (time.monotonic() if self._ended is None else self._ended) - self._began

    def cancel(self) -> None:
        """End it; what is sampled so far is kept."""
        self.cancelled = True
        with suppress(OSError):
            assert self._process.stdin is not None
            self._process.stdin.close()
        try:
            self._process.wait(_PATIENCE)
        except subprocess.TimeoutExpired:
            self._process.kill()

    def _follow(self) -> None:
        """Read the lines of the process until it ends."""
        assert self._process.stdout is not None
        with self._process.stdout as lines:
            for line in lines:
                with suppress(ValueError):
                    self._take(json.loads(line))
        code = self._process.wait()
        if self.trusted is None and not self.refusal and not self.cancelled:
            self.refusal = (
                f"The fit ended without an answer (exit code {code}); the usual cause is too little memory. Close other "
                "programs, and resume it."
            )
        if self.cancelled:
            remove_empty_results(self.request.output)
        self._ended = time.monotonic()

    def _take(self, line: dict[str, Any]) -> None:
        """Take what a line says."""
        self.progress = line.get("progress", "" if "stage" in line else self.progress)
        self.stage = line.get("stage", self.stage)
        self.refusal, self.trusted = line.get("refused", self.refusal), line.get("trusted", self.trusted)
        self.notes += [line["note"]] if "note" in line else []
