"""What keeps a page from being read by an engineer in a terminal: too wide, too long, no answer at its top, jargon.

Standard terms of statistics (R-hat, effective sample size, posterior, draws) may stand beside a plain explanation, but not on a
first page, which does without them.
"""

import re

JARGON = (
    r"\belpd\b", r"\bk\b(?!( rope)?: |/k rope: )", r"\bz\b", r"\bwalkers?\b", r"\bensembles?\b",
    r"\bcondition number\b",
    r"\blog rad\b", r"\w*(Normal|Cauchy)\(", r"\bcensored\b",
    r"\bs\.e\.", r"\b1 \w+s were\b", r"(?<![\d.,])\b1 (?!times\b|ms\b|is\b|was\b|has\b|does\b|less\b)[a-z]+s\b", r"\+-", r"\d%",
)  # fmt: skip
STATISTICS = (r"\bdraws?\b", r"\bposterior\b", r"\bR-hat\b", r"\beffective sample\b")  # that a first page does without
ANSWER = re.compile(
    r"cut the cable to \d|coefficients? of friction:? |best (guess|\w+ \w+) is \d|DO NOT USE|feed (forward|back) |feels ",
    re.IGNORECASE,
)


def faults(page: str, lines: int = 25) -> list[str]:
    """What is wrong with a printed page, a sentence each.

    Args:
        page: The page.
        lines: How many there may be.
    """
    rows = page.splitlines()
    page_faults = [f"wider than 80: {row}" for row in rows if len(row.encode()) > 80]
    page_faults += [f"{len(rows)} lines"] if len(rows) > lines else []
    page_faults += ["no answer in three lines"] if not ANSWER.search(" ".join(rows[:3])) else []
    return page_faults + jargon(page) + _terms(page, STATISTICS)


def jargon(text: str) -> list[str]:
    """Words that an engineer need not know, and counts that are wrong.

    Args:
        text: A page, a caption or a label.
    """
    return _terms(text, JARGON)


def _terms(text: str, patterns: tuple[str, ...]) -> list[str]:
    return [f"jargon: {word[0]!r}" for pattern in patterns if (word := re.search(pattern, text, re.IGNORECASE))]
