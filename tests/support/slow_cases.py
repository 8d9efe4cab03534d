"""Cases of a test of which the usual ones run by default, and the others where slow tests are run."""

from collections.abc import Collection, Iterable
from typing import Any

import pytest


def some_slow(cases: Iterable[Any], usual: Collection[Any]) -> list[Any]:
    """Parameters of a test, in order; a tuple is a case of several."""
    named_cases = [(case, case if isinstance(case, tuple) else (case,)) for case in cases]
    return [pytest.param(*parts, marks=() if case in usual else pytest.mark.slow) for case, parts in named_cases]
