"""A file or data frame that does not state its wrap angle, described for Python: what it holds, and the call that fits it."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from bowdenfit.display import Block, Display, Preformatted, blocks_of
from bowdenfit.frames import FILE, Frame, keyword_of, write_frame
from bowdenfit.kinds.fit_command import FitCommand
from bowdenfit.questions.check.single_file import describe_single_file
from bowdenfit.reading import Reading

_LISTS = ("--column", "--missing", "--set")  # options whose keyword takes a list


@dataclass(frozen=True, repr=False)
class LoneReport(Display):
    """What a table or recording holds that does not state its wrap angle, as `bowdenfit check FILE` shows it.

    Args:
        text: The report.
        is_usable: Whether it can be fitted once the angle is stated.
    """

    text: str
    is_usable: bool


@blocks_of.register
def _lone_blocks(report: LoneReport) -> Sequence[Block]:
    return [Preformatted(report.text)]


def describe_lone_table(table: str | Path | Frame, reading: Reading) -> LoneReport:
    """Describe a file or data frame that does not state its wrap angle.

    Args:
        table: The file or data frame.
        reading: Keywords of `bowdenfit.read`.

    Raises:
        BowdenfitError: It cannot be read, or not with these keywords.
    """
    if isinstance(table, str | Path):
        return LoneReport(*describe_single_file(Path(table), reading))
    with TemporaryDirectory() as folder:
        text, is_usable = describe_single_file(write_frame(table, Path(folder)), reading, _write_call)
    return LoneReport(text.replace(FILE, "the data frame"), is_usable)


def _write_call(command: FitCommand) -> str:
    """Return the call of Python that does what a command does with a data frame."""
    keywords = list[str]()
    for option in dict.fromkeys(name for name, _ in command.options):
        values = list(command.arguments(option))
        keywords.append(f"{keyword_of(option)}={values if option in _LISTS else repr(values[0])}")
    return f"  bf.fit({', '.join(['frame', *keywords])})"
