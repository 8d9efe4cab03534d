"""Start a data set: ask in a terminal what files do not say, and write the folder."""

import glob
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TypeVar

from bowdenfit.cli.terminal import say
from bowdenfit.errors import BowdenfitError, UsageError
from bowdenfit.files import FORMATS
from bowdenfit.questions.check.verb import check
from bowdenfit.questions.start.describe import describe_as_read, write_description
from bowdenfit.questions.start.folder import (
    describe_written_files,
    find_examples,
    find_measured_files,
    next_command,
    refuse_existing,
    refuse_files,
    write_data_set,
    write_example,
    write_template,
)
from bowdenfit.questions.start.notebook import NOTEBOOK
from bowdenfit.questions.start.question import Asker, Question, Unattended
from bowdenfit.reading import Reading
from bowdenfit.words import filled, printable

Answer = TypeVar("Answer")
FOLDER = "my-cable"
_MOST_FILES = 12  # that are proposed; a judgement
_LONGEST_NAME = 80  # characters of the name of a cable, a line of a terminal


class Terminal:
    """A person at a terminal."""

    def ask(self, question: Question[Answer]) -> Answer:
        """Ask until there is a valid answer, and return it."""
        say("")
        say(filled(question.words + (" (y or n)" if question.form == "yes or no" else "")))
        for i, option in enumerate(question.options if question.form != "word" else (), start=1):
            say(filled(f"{i}  {option}", "  "))
        if question.default is None:
            such = "" if question.options else f"such as {question.example}; "
            say(f"({such}no default, because the files do not state it)")
        shown = f"[{question.default}]" if question.default is not None else ""
        while True:
            typed = _read_line(f"{shown}> ") or question.default or ""
            if not typed.strip():
                say("An answer is needed here. Ctrl-C stops without writing anything.")
                continue
            try:
                return question.read(typed)
            except BowdenfitError as error:
                say(filled(f"{str(error)[:1].upper()}{str(error)[1:]}"))

    def say(self, sentence: str) -> None:
        """Print what was understood without asking."""
        say(filled(sentence))

    def report(self, sentence: str) -> None:
        """Print what is left out."""
        say(filled(sentence))

    def settle(self) -> None:
        """Do nothing: everything was answered."""


def _read_line(prompt: str) -> str:
    """Return the line typed after a prompt."""
    say(prompt, nl=False)
    sys.stdout.flush()
    line = sys.stdin.readline()
    if not line:
        say("")
        raise KeyboardInterrupt
    return line.rstrip("\n")


def is_interactive() -> bool:
    """Whether a person is at the terminal."""
    return sys.stdin is not None and sys.stdin.isatty() and sys.stdout.isatty()


def start_data_set(
    folder: Path | None,
    files: Sequence[Path],
    example: Sequence[str] | None,
    reading: Reading | None = None,
    notebook: bool = False,
) -> None:
    """Write a new data set.

    Args:
        folder: The folder to write; asked for if None.
        files: Measured files.
        example: Name of an example, and its folder; all are listed if empty. None for no example.
        reading: Options of `fit` that describe the file; nothing is then asked.
        notebook: Whether a notebook is written beside an example.
    """
    if notebook and not example:
        raise UsageError("--notebook goes with an example: bowdenfit init --example on-body-exoskeleton --notebook.")
    if reading and (example is not None or not files):
        raise UsageError("options of fit, such as --wrap-angle, describe one measured file; name it after --from.")
    if example is not None:
        _example(example, folder, files, notebook)
        return
    target, measured = split_folder_and_files(folder, files)
    if not is_interactive() and target is None and not measured:
        raise UsageError(f"name the folder to write, such as bowdenfit init {FOLDER}.")
    ask: Asker = Terminal() if is_interactive() else Unattended()
    refuse_existing(target or Path(FOLDER))
    ask.say("Press Enter to accept the answer in brackets. Ctrl-C stops without writing anything.")
    target = target or _ask_folder(ask)
    if not measured and is_interactive():
        measured = _ask_files(ask)
    if measured and reading:
        _start_from_options(target, measured, reading)
        return
    if measured:
        _start_from_files(target, measured, ask)
        return
    write_template(target)
    say(filled(f"Wrote a template to {target}: fill in what is in capitals in its cable.toml, and the tables."))
    say(f"Next: bowdenfit check {shlex.quote(str(target))}")


def split_folder_and_files(folder: Path | None, files: Sequence[Path]) -> tuple[Path | None, list[Path]]:
    """Return the folder to write and the measured files; the folder may follow the files of --from."""
    named = [*([folder] if folder else []), *files]
    folders = [path for path in named if not (files and path.is_file())]
    if len(folders) > 1:
        raise UsageError(f"{folders[-1]} does not exist; name one new folder, and the files after --from.")
    return next(iter(folders), None), [path for path in named if path not in folders]


def _example(named: Sequence[str], folder: Path | None, files: Sequence[Path] | None, notebook: bool) -> None:
    """Write an example, into a folder that may be named behind it, or say which there are."""
    if files:
        raise UsageError("--from and --example both say what to write; leave one of them out.")
    if not named:
        for known in find_examples():
            say(known)
        return
    name, folder = named[0], folder or Path(named[-1])
    write_example(name, folder, notebook)
    say(f"Wrote {folder}. Next: bowdenfit {next_command(folder)}")
    if notebook:
        say(f"Or open {folder / NOTEBOOK} in Jupyter.")


def _ask_folder(ask: Asker) -> Path:

    def read(typed: str) -> Path:
        refuse_existing(Path(typed.strip()).expanduser())
        return Path(typed.strip()).expanduser()

    return ask.ask(Question("Which folder should be written?", read, FOLDER))


def _ask_files(ask: Asker) -> list[Path]:
    """Ask for the measured files; none where only a template is to be written."""
    here = find_measured_files(Path(), list(FORMATS))

    def read(typed: str) -> list[Path]:
        if typed.strip() == "-":
            return []
        try:
            names = shlex.split(typed)
        except ValueError:
            raise UsageError("a quotation mark is not closed; close it.") from None
        paths = [Path(match).expanduser() for name in names for match in (sorted(glob.glob(name)) or [name])]  # noqa: PTH207
        refuse_files(paths)
        return paths

    words = "Which files did you measure? Separate names by spaces, or give a pattern such as bench/*.csv (- for none yet)."
    proposed = shlex.join([path.name for path in here]) if 0 < len(here) <= _MOST_FILES else "-"
    return ask.ask(Question(words, read, proposed))


def _start_from_files(folder_: Path, files: Sequence[Path], ask: Asker) -> None:
    """Describe the files, write the folder, and check that `check` accepts it."""
    refuse_files(files)
    called = printable(folder_.name.replace("-", " ").replace("_", " "))[:_LONGEST_NAME]
    text = write_description(files, (called.strip() and called) or "cable", ask)
    if isinstance(ask, Unattended):
        for sentence in ask.left_out:
            say(filled(sentence))
    _write_and_check(folder_, text, files)


def _start_from_options(folder: Path, files: Sequence[Path], reading: Reading) -> None:
    """Write the folder of one file that options describe as `fit` reads it, and check it."""
    if len(files) > 1:
        raise UsageError(
            f"options of fit describe one file, and {len(files)} are named after --from; leave the options out and answer in a "
            "terminal, or start with one file and add the others to its cable.toml."
        )
    refuse_files(files)
    _write_and_check(folder, describe_as_read(files[0], reading), files)


def _write_and_check(folder_: Path, text: str, files: Sequence[Path]) -> None:
    """Write the folder, and check that `check` accepts it."""
    write_data_set(folder_, text, files)
    say("")
    say(filled(describe_written_files(folder_)))
    folder = shlex.quote(str(folder_))
    try:
        check(folder_)
    except BowdenfitError as error:
        say(f"The files cannot be fitted yet. Correct them in {folder}, then run: bowdenfit check {folder}")
        raise error from None
    say(f"Next: bowdenfit fit {folder}\n(bowdenfit check {folder} says how every row was understood)")
