"""What README.md and the guides show: blocks of commands, of Python, of descriptions, and what commands print.

A command whose output is shown stands behind a $ in a block `console`; a line of three dots there stands for lines left out. A
command that the tests leave alone says so behind it: `# not run here: why`.
"""

import re
import shlex
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
FIRST = "on-body-exoskeleton"  # the data set of the first fit
PUBLISHED = {  # what commands print of fits that are published
    ("bowdenfit", "fit", FIRST): ROOT / "fits" / "published" / FIRST / "summary.txt",
    ("bowdenfit", "compare", "fits/plain", "fits/rate"): ROOT / "fits/published/synthetic-recordings/comparison.txt",
}
ELISION = "..."
_BLOCK = re.compile(r"^```(?P<language>[a-z]+)\n(?P<text>.*?)^```$", re.MULTILINE | re.DOTALL)
_NOT_RUN = "# not run here:"


@dataclass(frozen=True)
class Block:
    """One block of a page.

    Args:
        page: The file.
        line: Where it begins.
        language: What it is.
        text: What stands in it.
    """

    page: Path
    line: int
    language: str
    text: str

    def __str__(self) -> str:
        return f"{self.page.name}:{self.line}"

    @property
    def commands(self) -> tuple[tuple[str, ...], ...]:
        """The words of each command that is run."""
        lines = self.text.replace("\\\n", " ").splitlines()
        if self.language == "console":
            lines = [line.removeprefix("$ ") for line in lines if line.startswith("$ ")]
        split = (tuple(shlex.split(line, comments=True)) for line in lines if _NOT_RUN not in line)
        return tuple(words for words in split if words)

    @property
    def shown(self) -> Iterator[tuple[tuple[str, ...], str]]:
        """Each command with what it is shown to print."""
        for part in re.split(r"^\$ ", self.text, flags=re.MULTILINE)[1:]:
            command, _, output = part.partition("\n")
            yield tuple(shlex.split(command, comments=True)), output


def blocks(*languages: str, pages: tuple[Path, ...] = PAGES) -> list[Block]:
    """All blocks of some languages."""
    results = []
    for page in pages:
        text = page.read_text(encoding="utf-8")
        for match in _BLOCK.finditer(text):
            if match["language"] in languages:
                line = text.count("\n", 0, match.start()) + 1
                results.append(Block(page, line, match["language"], match["text"]))
    return results


def as_shown(shown: str, printed: str, as_read: Callable[[str], str] = str) -> bool:
    """Whether an output is what a page shows of it, byte for byte where nothing is left out.

    Args:
        shown: On the page.
        printed: By the command.
        as_read: What of both is compared, such as `masked`.
    """
    parts = re.split(rf"^{re.escape(ELISION)}\n", shown, flags=re.MULTILINE)
    return re.fullmatch("(?s:.*)".join(re.escape(as_read(part)) for part in parts), as_read(printed)) is not None


def masked(text: str) -> str:
    """Words without numbers, and without how wide the columns are: what another machine prints too."""
    text = re.sub(r"[-+−]?\d+(\.\d+)?(e[-+]?\d+)?", "#", text)
    return " ".join(re.sub(r"-{3,}", "---", text).split())
