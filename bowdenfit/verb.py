"""A verb: one function for notebooks, and what the command line prints of its answer. Loads little."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from bowdenfit.extensions import VERBS, list_names, load_extension, report_problem
from bowdenfit.stage_bar import Watch

NOT_TRUSTED = 3  # exit code


@dataclass(frozen=True)
class Reply:
    """What the command line prints of an answer.

    Args:
        text: For people.
        page: Gives the answer for programs, asked only for `--json`.
        csv: Gives it as CSV, asked only for `--csv`.
        notes: Lines beside the answer, on standard error.
        pieces: Parts of lines that are printed as they come, before the text.
        exit_code: 0; 3 for an answer that must not be trusted, 2 for what is said of input that cannot be used.
    """

    text: str
    page: Callable[[], Any] | None = None
    notes: tuple[str, ...] = ()
    exit_code: int = 0
    csv: Callable[[], str] | None = None
    pieces: Iterable[str] = ()


@dataclass(frozen=True)
class Verb:
    """One verb of the command line and of notebooks.

    Args:
        function: Function that notebooks call.
        reply: Makes what the command line prints from the answer and its keywords.
        text: The verb's help, in lines of at most 80 characters. The list of verbs shows the first, which stands apart.
        name: On the command line; the function's if omitted.
        json: Contents of `--json`, in words; empty without that option.
        csv: Contents of `--csv`, in words; empty without that option.
        results: Folder in which results go unless `output` names another.
        watch: How it is interrupted; None if it is quick.
        warns: Whether a fit that is not to be trusted is said beside the answer, which then ends with `NOT_TRUSTED`.
        needs_coefficients: Whether the answer rests on every coefficient, not only on what makes a length the best.
        explains: A trouble of a fit that the answer is about, so that it is right in spite of it.
        kept: The reply by what a fit has answered before, and the keywords; None where they ask for something else. A
            reply without a page is for people only.
        serves: Whether it works until it is interrupted and answers nothing, as what serves pages does: then it is a command
            alone, and has no stages.
        reads: Name of the file by which a folder is known to be read by this verb of an add-on, such as "cables.toml"; a verb
            that is asked of a fit reads the file itself.
        referral: What to say of such a folder to who takes it for that of a single cable, with {folder} in it.
    """

    function: Callable[..., Any]
    reply: Callable[..., Reply]
    text: str
    name: str = ""
    json: str = "Print as JSON."
    csv: str = ""
    results: str = ""
    watch: Watch | None = None
    warns: bool = False
    needs_coefficients: bool = False
    explains: str = ""
    kept: Callable[[Mapping[str, Any], Mapping[str, Any]], Reply | None] | None = None
    serves: bool = False
    reads: str = ""
    referral: str = ""

    @property
    def command_name(self) -> str:
        """Its name on the command line."""
        return self.name or self.function.__name__


def load_added_verb(name: str) -> Verb | None:
    """Load a verb of an add-on; None if there is none of this name, or it cannot be used."""
    verb = load_extension(VERBS, name)
    if verb is None or (isinstance(verb, Verb) and verb.command_name == name):
        return verb
    report_problem(f"the entry point {name!r} of {VERBS} is left out: it must be a Verb with this name.")
    return None


def load_added_verbs() -> list[Verb]:
    """Load the verbs of all add-ons that can be used, in alphabetical order."""
    verbs = (load_added_verb(name) for name in list_names(VERBS))
    return [verb for verb in verbs if verb is not None]
