"""Verbs that belong to the command line alone: a new data set, and completion of words by the shell."""

import glob
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from bowdenfit.cli.explained import Explained
from bowdenfit.cli.terminal import say
from bowdenfit.errors import BowdenfitError, UsageError
from bowdenfit.words import filled, printable

if TYPE_CHECKING:
    from bowdenfit.questions.start.question import Asker

FOLDER = "my-cable"
_MOST_FILES = 12  # that are proposed
_LONGEST_NAME = 80  # of a cable
_INIT = """Write a new data set to FOLDER, ready for `bowdenfit check` and `bowdenfit fit`.

    In a terminal it asks for the files that you measured, and for what they do not say: which contacts there are, where their
    wrap angles come from, what the columns are, and their units. With --from it asks only for what these files do not say, and
    where nobody can be asked it refuses what is not said. Without files and without a terminal it writes a template to fill in.

    \b
    init my-cable                          questions, from the first to the command that fits
    init my-cable --from forces.csv        of this file, or of several
    init --example on-body-exoskeleton     a data set to try
    """


@click.command(
    cls=Explained, help=_INIT, short_help="Start a data set: by questions, from files, from an example, or with a template."
)
@click.argument("folder", required=False, type=click.Path(path_type=Path))
@click.argument("more", nargs=-1, type=click.Path(path_type=Path), metavar="")
@click.option("--from", "files", multiple=True, type=click.Path(path_type=Path), metavar="FILE [FILE ...]",
              help="Files that you measured: they are copied into FOLDER, with a cable.toml that fits them.")  # fmt: skip
@click.option("--example", is_flag=False, flag_value="", metavar="[NAME]",
              help="Write a data set that comes with bowdenfit; without a name, list them.")  # fmt: skip
def init(folder: Path | None, more: tuple[Path, ...], files: tuple[Path, ...], example: str | None) -> None:
    """Write a new data set."""
    from bowdenfit.cli.dialog import Terminal, has_person
    from bowdenfit.questions.start.folder import refuse_existing, write_template
    from bowdenfit.questions.start.question import Nobody

    place, given = _folder_and_files(folder, more, files)
    if example is not None:
        _example(example, place, given)
        return
    if not has_person() and place is None and not given:
        raise UsageError(f"name the folder to write, such as bowdenfit init {FOLDER}.")
    ask: Asker = Terminal() if has_person() else Nobody()
    refuse_existing(place or Path(FOLDER))
    ask.say("Enter takes the answer that stands in brackets; Ctrl-C ends it all, and nothing is written.")
    place = place or _asked_folder(ask)
    if not given and has_person():
        given = _asked_files(ask)
    if given:
        _from_files(place, given, ask)
        return
    write_template(place)
    say(filled(f"Wrote a template to {place}: fill in what stands in capitals in its cable.toml, and the tables."))
    say(f"Next: bowdenfit check {shlex.quote(str(place))}")


def _folder_and_files(
    folder: Path | None, more: Sequence[Path], files: Sequence[Path]
) -> tuple[Path | None, list[Path]]:
    """Which of what was named is the folder to write, and which are files: behind --from there may be several."""
    named = [each for each in (folder, *more) if each is not None]
    places = [each for each in named if not (files and each.is_file())]
    if len(places) > 1:
        what = "does not exist" if files else "is one name too many"
        raise UsageError(f"{places[-1]} {what}; name one new folder, and the files behind --from.")
    return next(iter(places), None), [*files, *(each for each in named if each not in places)]


def _example(name: str, place: Path | None, files: Sequence[Path]) -> None:
    """Write an example, or say which there are."""
    from bowdenfit.questions.start.folder import examples, verb_of, write_example

    if files:
        raise UsageError("--from and --example both say what to write; leave one of them out.")
    if not name:
        for known in examples():
            say(known)
        return
    folder = place or Path(name)
    write_example(name, folder)
    say(f"Wrote {folder}. Next: bowdenfit {verb_of(folder)} {shlex.quote(str(folder))}")


def _asked_folder(ask: "Asker") -> Path:
    from bowdenfit.questions.start.folder import refuse_existing
    from bowdenfit.questions.start.question import Question

    def read(typed: str) -> Path:
        refuse_existing(Path(typed.strip()).expanduser())
        return Path(typed.strip()).expanduser()

    return ask.ask(Question("Which folder shall be written?", read, FOLDER))


def _asked_files(ask: "Asker") -> list[Path]:
    """The files that were measured; none where there is only a template to write."""
    from bowdenfit.files import FORMATS
    from bowdenfit.questions.start.folder import measured_files, refuse_files
    from bowdenfit.questions.start.question import Question

    here = measured_files(Path(), list(FORMATS))

    def read(typed: str) -> list[Path]:
        if typed.strip() == "-":
            return []
        try:
            names = shlex.split(typed)
        except ValueError:
            raise UsageError("a quotation mark is not closed; close it.") from None
        found = [Path(each).expanduser() for name in names for each in (sorted(glob.glob(name)) or [name])]  # noqa: PTH207
        refuse_files(found)
        return found

    words = "Which files did you measure? Names with blanks between, or a pattern such as bench/*.csv (- for none yet)."
    proposed = shlex.join([path.name for path in here]) if 0 < len(here) <= _MOST_FILES else "-"
    return ask.ask(Question(words, read, proposed))


def _from_files(place: Path, files: Sequence[Path], ask: "Asker") -> None:
    """Describe files, write the folder, and see whether `check` accepts it."""
    from bowdenfit.questions.check.verb import check
    from bowdenfit.questions.start.describe import description_of
    from bowdenfit.questions.start.folder import refuse_files, write_data_set, written

    refuse_files(files)
    called = printable(place.name.replace("-", " ").replace("_", " "))[:_LONGEST_NAME]
    text = description_of(files, (called.strip() and called) or "cable", ask)
    write_data_set(place, text, files)
    click.echo()
    say(filled(written(place)))
    folder = shlex.quote(str(place))
    try:
        check(place)
    except BowdenfitError as error:
        say(f"The files cannot be fitted yet. Correct them in {folder}, then run: bowdenfit check {folder}")
        raise error from None
    say(f"Next: bowdenfit fit {folder}\n(bowdenfit check {folder} says how every row was understood)")


@click.command(short_help="Print the shell completion script.")
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
@click.pass_context
def completion(context: click.Context, shell: str) -> None:
    """Print the completion script for SHELL; for bash: eval "$(bowdenfit completion bash)"."""
    from click.shell_completion import get_completion_class

    script = get_completion_class(shell)
    assert script is not None  # the three shells above have one
    click.echo(script(context.find_root().command, {}, "bowdenfit", "_BOWDENFIT_COMPLETE").source())
