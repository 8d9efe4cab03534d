"""Figures that several tests of a file look at and none changes: drawn once, and forgotten at the end of the file."""

from collections.abc import Callable, Iterator, Mapping
from functools import cache
from typing import Any

import pytest

from bowdenfit.questions.figures import FIGURES


class DrawnOnce:
    """Data and figures of cases.

    Args:
        cases: What makes the data of each, by figure.
    """

    def __init__(self, cases: Mapping[str, Callable[[], Mapping[str, Any]]]) -> None:
        self.data = cache(lambda case: cases[case]())
        self.figure = cache(lambda name, case: FIGURES[name].draw(self.data(case)[name]))

    def forgotten(self) -> Any:
        """A fixture of the file that uses it."""

        @pytest.fixture(scope="module", autouse=True)
        def forget() -> Iterator[None]:
            yield
            self.figure.cache_clear()

        return forget
