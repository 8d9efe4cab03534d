"""When work is given to more processes: where they save clearly more than it takes to begin them, and not before."""

import time
from collections.abc import Callable
from concurrent.futures import Executor, Future

import pytest

from bowdenfit.inference.engines.engine import HereOrInProcesses, Taken, processes_pay

COMPILED = Taken(5.0, 5.0)


@pytest.mark.parametrize(
    ("taken", "left", "workers", "pay"),
    [
        # Two workers save half of the time that one core computes, and take compiling and loading to begin.
        pytest.param([COMPILED, Taken(1.0, 1.0), Taken(1.0, 1.0)], 20, 2, False, id="ten seconds less for six"),
        pytest.param([COMPILED, Taken(1.0, 1.0), Taken(1.0, 1.0)], 30, 2, True, id="fifteen seconds less for six"),
        pytest.param([COMPILED, Taken(1.0, 2.0), Taken(1.0, 2.0)], 1000, 2, False, id="threads use both cores already"),
        pytest.param([COMPILED, Taken(1.0, 1.5), Taken(1.0, 1.5)], 40, 2, False, id="threads use three quarters"),
        pytest.param([COMPILED, Taken(1.0, 1.5), Taken(1.0, 1.5)], 60, 2, True, id="threads use three quarters, for long"),
        pytest.param([COMPILED, Taken(1.0, 1.5), Taken(1.0, 1.5)], 40, 16, True, id="many cores are idle"),
        pytest.param([COMPILED, COMPILED, Taken(1.0, 1.0)], 30, 2, False, id="something compiled in the second"),
        pytest.param([Taken(1.0, 1.0)] * 3, 7, 2, False, id="nothing to compile, yet to load"),
        pytest.param([Taken(0.0, 0.0)] * 3, 1000, 2, False, id="nothing to do"),
    ],
)
def test_more_processes_must_save_more_than_they_take(taken: list[Taken], left: int, workers: int, pay: bool) -> None:
    assert processes_pay(taken, left, workers) == pay


class Asked(Executor):
    """Does at once what it is given, and counts."""

    def __init__(self) -> None:
        self.pieces = 0

    def submit(self, function: Callable, /, *arguments, **named) -> "Future":
        self.pieces += 1
        done: Future = Future()
        done.set_result(function(*arguments, **named))
        return done


@pytest.mark.parametrize(("number", "given_away"), [(60, 0), (1000, 997)])
def test_work_goes_to_processes_only_where_it_lasts(monkeypatch: pytest.MonkeyPatch, number: int, given_away: int) -> None:
    now = [0.0]
    monkeypatch.setattr(time, "perf_counter", lambda: now[0])
    monkeypatch.setattr(time, "process_time", lambda: now[0])

    def work(piece: int) -> int:
        now[0] += 3.0 if piece == 0 else 0.1
        return piece * piece

    executor = Asked()
    engine = HereOrInProcesses[int, int](lambda: executor, 2)
    assert sorted(engine.results(work, range(number))) == [piece * piece for piece in range(number)]
    assert executor.pieces == given_away
