"""The commands of the program: each verb with the arguments and options of its function, and what it prints."""

import json
import os
from collections.abc import Collection, Sequence
from contextlib import suppress
from dataclasses import replace
from importlib.metadata import version
from inspect import Parameter as Stated
from inspect import Signature, unwrap
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args, get_origin

from cyclopts import (
    App,
    CycloptsError,
    Group,
    MissingArgumentError,
    Parameter,
    RepeatArgumentError,
    UnusedCliTokensError,
)
from cyclopts.help import DefaultFormatter, PanelSpec
from docstring_parser.google import parse
from rich.box import Box

import bowdenfit as bf
from bowdenfit import results
from bowdenfit.arguments import FIT, FITS, Declared, parameters_of, read_arguments
from bowdenfit.cli.running import requested, watch_verb
from bowdenfit.cli.stage_line import above_stages, print_stages, say_beside_stages, show_stages
from bowdenfit.cli.terminal import NoReaderError, say
from bowdenfit.errors import UsageError
from bowdenfit.reading import Reading
from bowdenfit.results.answer_cache import COEFFICIENT_TROUBLES, TROUBLES, read_answers
from bowdenfit.results.data_changes import DataChanges, find_data_changes
from bowdenfit.results.folder import FIT as FIT_FILE
from bowdenfit.results.folder import refuse_unwritable
from bowdenfit.verb import NOT_TRUSTED, Reply, Verb
from bowdenfit.verbs import VERBS
from bowdenfit.words import few, listed, shown

if TYPE_CHECKING:
    from bowdenfit.finished_fit import Fit

LOOK: dict[str, Any] = {  # of every command
    "default_parameter": Parameter(negative=(), show_default=False, json_list=False, json_dict=False),
    "group_arguments": Group("Arguments", sort_key=1),
    "group_parameters": Group("Options", sort_key=2),
    "group_commands": Group("Commands", sort_key=3),
    "help_format": "plaintext",
    "help_formatter": DefaultFormatter(panel_spec=PanelSpec(box=Box("    \n" * 8), padding=(0, 0, 0, 3))),
    "print_error": False,
    "exit_on_error": False,
    "suppress_keyboard_interrupt": False,
    "result_action": "return_value",
}


_CHANGED = "changed_since_fit"  # key of --json
_READING_PARAMETERS = parse(Reading.__doc__ or "").params  # which several verbs share


def command(verb: Verb) -> App:
    """Return the command of a verb: a function with the signature that cyclopts reads, which asks the verb.

    Args:
        verb: Verb of the command; see `bowdenfit.verb`.
    """
    command_signature = _command_signature(verb)

    def run(*arguments: Any, **options: Any) -> int:
        request = command_signature.bind(*arguments, **options).arguments
        if request.pop("verbose", False):
            print_stages()
        forms = [form for form in ("json", "csv") if request.pop(form, False)]
        if len(forms) == 2:
            raise UsageError("--json and --csv are two forms of the same answer; name one of them.")
        return _run(verb, request, "".join(forms))

    run.__annotations__, vars(run)["__signature__"] = {}, command_signature
    return App(name=verb.command_name, help=verb.text, default_command=run, **LOOK)


def _command_signature(verb: Verb) -> Signature:
    """Return the signature that cyclopts reads: the function's parameters, and --csv and --json."""
    described = [*_READING_PARAMETERS, *parse(verb.function.__doc__ or "").params]
    words = {parameter.arg_name: " ".join((parameter.description or "").split()) for parameter in described}
    declared = parameters_of(verb.function).items()
    parameters = [
        _command_parameter(parameter, words.get(name)) for name, parameter in declared if parameter.option.parse is not False
    ]
    for form, meaning in (("csv", verb.csv), ("json", verb.json)):
        if meaning:
            annotation = Annotated[bool, Parameter(help=meaning)]
            parameters.append(Stated(form, Stated.KEYWORD_ONLY, default=False, annotation=annotation))
    if not verb.serves:
        of_verbose = Parameter(name=["--verbose", "-v"], help="Print each stage of the work, with the time of day.")
        parameters.append(Stated("verbose", Stated.KEYWORD_ONLY, default=False, annotation=Annotated[bool, of_verbose]))
    return Signature(parameters)


def _command_parameter(declared: Declared, words: str | None) -> Stated:
    """Return a parameter for cyclopts: positional if its name is in capitals, as text if a reader reads it."""
    type_, default = declared.type, declared.plain.default
    about, by_place = [Parameter(help=words)], declared.written_name.isupper()
    kind = Stated.POSITIONAL_ONLY if by_place else Stated.KEYWORD_ONLY
    if declared.reader:
        type_ = declared.reader.command_line_type
    elif choices := [part for part in (type_, *get_args(type_)) if get_origin(part) is Literal]:
        type_, about = str, [*about, Parameter(choices=choices[0])]
    if by_place and get_origin(type_) is list:  # wherever they stand among the options
        about, marked = [*about, Parameter(required=default is Stated.empty)], get_args(type_)[0]
        return Stated(declared.plain.name, Stated.VAR_POSITIONAL, annotation=Annotated[marked, *about, declared.option])
    if default is not Stated.empty and not isinstance(default, bool):
        about += [] if default in (None, ()) else [Parameter(show_default=str(default))]
        type_, default = type_ | None, None
    if not by_place and type_ is not bool:
        about.append(Parameter(allow_leading_hyphen=True))  # -5N is a value, if a wrong one
    return Stated(declared.plain.name, kind, default=default, annotation=Annotated[type_, *about, declared.option])


def describe_error(error: CycloptsError) -> str:
    """Return what to say of a command that cannot be understood."""
    see = f"See {' '.join(['bowdenfit', *(error.command_chain or ())])} --help."
    if isinstance(error, UnusedCliTokensError):
        extra = error.unused_tokens or []
        return f"Unexpected argument {listed(extra)}. {_suggest_join(error.command_chain or (), extra)}{see}"
    if isinstance(error, RepeatArgumentError):
        return f"{error.token.keyword} is given twice, and only one can count; leave one out. {see}"
    if isinstance(error, MissingArgumentError) and error.argument is not None and error.argument.index is not None:
        name, words = error.argument.name, error.argument.parameter.help or ""
        dots, many = ("...", "some") if get_origin(error.argument.hint) is tuple else ("", "one")
        return f"Missing argument '{name}{dots}'. Name {many}, {words[:1].lower()}{words[1:]}"
    return f"{error} {see}"


def _suggest_join(command: Sequence[str], extra: Sequence[str]) -> str:
    """Return how a second file is joined, where a command that reads recordings was given one; else empty."""
    if not {"check", "fit"} & {*command} or len(extra) != 1 or not Path(extra[0]).is_file():
        return ""
    return f"If a second logger recorded the output force in it, join it: --join {extra[0]}. "


def _run(verb: Verb, options: dict[str, Any], form: str) -> int:
    """Run a verb, and print its reply for people, or as "json" or "csv"; return the exit code."""
    _refuse_flags_of_others(os.environ.get("XLA_FLAGS", ""))
    parameters = parameters_of(verb.function).items()
    declared = {name: parameter for name, parameter in parameters if parameter.option.parse is not False}
    request = {name: parameter.plain.default for name, parameter in declared.items()} | options
    first, source = next(iter(request.items()))
    is_of_fit = declared[first].reader in (FIT, FITS)
    texts = {name: value for name, value in request.items() if declared[name].reader not in (None, FIT, FITS)}
    request |= read_arguments(verb.function, texts, typed=True)
    answers = _load_kept_answers(source) if isinstance(source, Path) and (verb.kept or verb.warns) else {}
    reply = _reply_from_kept(verb, answers, request)
    if reply is None or (form == "json" and reply.page is None) or (form == "csv" and reply.csv is None):
        request[first] = _load_fits(source) if is_of_fit else source
        reply = _compute_reply(verb, request, source, form)
    if verb.warns and isinstance(source, Path):
        key = COEFFICIENT_TROUBLES if verb.needs_coefficients else TROUBLES
        troubles = answers[key] if key in answers else _list_troubles(request[first], source, verb.needs_coefficients)
        reply = _add_warning(reply, [trouble for trouble in troubles if trouble != verb.explains], source)
    changes = _find_data_changes(source)
    notes = [of_fit.describe(f"the fit {folder}") for folder, of_fit in changes.items()]
    _print_answer(reply, form, {str(folder): list(of_fit.files) for folder, of_fit in changes.items()})
    for note in (*reply.notes, *notes):
        say(note, err=True)
    return reply.exit_code


def _print_answer(reply: Reply, form: str, changed: dict[str, list[str]] | None = None) -> None:
    """Print an answer for people, or as "json" or "csv"; `changed` are the files that have changed since, by fit."""
    for piece in reply.pieces:
        say(piece, nl=False)
    say(_to_json(reply, changed) if form == "json" else reply.csv() if form == "csv" and reply.csv else reply.text, nl=False)


def _refuse_flags_of_others(flags: str) -> None:
    """Refuse flags that XLA cannot know, over which it would end the process in words of its own.

    Raises:
        UsageError: There is one.
    """
    remaining = [word for word in flags.split() if word.startswith("-") and not word.startswith("--xla_")]
    if remaining:
        raise UsageError(
            f"XLA_FLAGS in the environment holds {few([shown(word) for word in remaining])}, and flags of XLA begin with --xla_"
            "; unset XLA_FLAGS, or correct it."
        )


def _load_kept_answers(source: Path) -> dict[str, Any]:
    """Return the answers that are kept in a results folder, by question."""
    return read_answers(source)


def _reply_from_kept(verb: Verb, answers: dict[str, Any], request: dict[str, Any]) -> Reply | None:
    """Return the reply from kept answers; None if this question is not among them."""
    try:
        return verb.kept(answers, request) if verb.kept and answers else None
    except (LookupError, TypeError, ValueError, AttributeError, ArithmeticError):  # kept when the answer had another shape
        return None


def _compute_reply(verb: Verb, request: dict[str, Any], source: Any, form: str) -> Reply:
    """Call the verb's function, and return its reply, without an answer that was printed as soon as it was known."""
    if verb.results and request["output"] is None:
        request["output"] = Path(verb.results) / _results_name(source)
    if request.get("output") is not None:
        refuse_unwritable(request["output"])
    function = unwrap(verb.function)  # whose arguments have been read
    if "report" in parameters_of(function):
        request["report"] = say_beside_stages
    if "is_stopped" in parameters_of(function):
        request["is_stopped"] = requested.is_set
    if "say" in parameters_of(function):
        request["say"] = say
    printed: list[Reply] = []

    def print_early(answer: Any) -> None:
        printed.append(verb.reply(answer, request))
        with above_stages(), suppress(NoReaderError):
            _print_answer(printed[-1], form)

    if "answered" in parameters_of(function):
        request["answered"] = print_early
    if verb.serves:
        answer = function(**request)
    elif verb.watch is None:
        with show_stages(None):
            answer = function(**request)
    else:
        with watch_verb(request["output"], verb.watch) as progress:
            answer = function(**request, progress=progress)
    return replace(printed[-1], text="", page=None) if printed else verb.reply(answer, request)


def _list_troubles(fit: Any, source: Path, of_coefficients: bool) -> Collection[str]:
    """Return why a fit is not to be trusted; empty if the source is not a fit.

    Args:
        fit: The fit, if it has been loaded; else the same as `source`.
        source: Its results folder, or what else a verb may be asked of.
        of_coefficients: Whether every coefficient must be determined.
    """
    if fit is source and (source / FIT_FILE).exists():
        fit = _load_fits(source)
    if isinstance(fit, Path):
        return ()
    verdict = fit.verdict()
    return tuple((verdict.for_coefficients() if of_coefficients else verdict).troubles)


def _add_warning(reply: Reply, troubles: Collection[str], results: Path) -> Reply:
    """Return the reply with a warning and an exit code if the fit is not to be trusted."""
    warning = f"Warning: this fit is {' and '.join(troubles)}; see bowdenfit summary {results}."
    return replace(reply, notes=(*reply.notes, warning), exit_code=reply.exit_code or NOT_TRUSTED) if troubles else reply


def _find_data_changes(source: Any) -> dict[Path, DataChanges]:
    """Return what changed since each of the fits that a verb was asked of, of those whose data have changed."""
    folders = source if isinstance(source, tuple | list) else (source,)
    fits = [folder for folder in folders if isinstance(folder, Path) and (folder / FIT_FILE).is_file()]
    return {folder: changes for folder in fits if (changes := find_data_changes(folder)).files}


def _to_json(reply: Reply, changed: dict[str, list[str]] | None) -> str:
    """Return an answer as JSON, with the files that have changed since each fit, if any have; in each row of several."""
    if reply.page is None:
        return reply.text
    answer = results.plain_data(reply.page())
    for part in answer if isinstance(answer, list) else [answer]:
        if changed and isinstance(part, dict):
            part[_CHANGED] = changed
    return json.dumps(answer, indent=1, allow_nan=False) + "\n"


def _load_fits(results: Path | tuple[Path, ...]) -> "Fit | dict[str, Fit]":
    """Load one fit, or several by folder name (by path from the common folder where two names are equal)."""
    if isinstance(results, Path):
        return bf.Fit.load(results)
    names = [folder.name for folder in results]
    paths = [folder.resolve() for folder in results]
    above = Path(os.path.commonpath(paths)) if len(set(paths)) > 1 else Path(paths[0].anchor)
    return {
        name if names.count(name) == 1 or path == above else str(path.relative_to(above)): bf.Fit.load(folder)
        for name, path, folder in zip(names, paths, results, strict=True)
    }


def _results_name(dataset: Path) -> str:
    """Return the default name of a data set's results folder."""
    return dataset.stem if dataset.suffix else dataset.resolve().name


INIT_HELP = """Start a data set: by questions, from files, or from an example.

In a terminal it asks for the files that you measured, and for what they do
not say: which contacts there are, where their wrap angles come from, what the
columns are, and their units. With --from it asks only for what these files do
not say, and without a terminal it refuses to guess the rest. Without
files and without a terminal it writes a template to fill in.

  init my-cable                       questions, from the first to the command
                                      that fits
  init my-cable --from forces.csv     of this file, or of several
  init my-cable --from forces.csv --wrap-angle 180deg
                                      of one file, said by the options of fit
  init --example on-body-exoskeleton  a data set to try
"""


def init(
    folder: Annotated[Path | None, Parameter("FOLDER")] = None,
    /,
    *,
    files: Annotated[list[Path] | None, Parameter("--from", metavar="FILE...", consume_multiple=True)] = None,
    example: Annotated[
        list[str] | None, Parameter(metavar="[NAME]", consume_multiple=(0, 2), completer=lambda _: _examples())
    ] = None,
    notebook: bool = False,
    wrap_angle: Annotated[str | None, Parameter(metavar="ANGLE")] = None,
    columns: Annotated[list[str] | None, Parameter("--column", metavar="QUANTITY=COLUMN:UNIT")] = None,
    channels: Annotated[list[str] | None, Parameter("--channel", metavar="QUANTITY=CHANNEL:UNIT")] = None,
    settings: Annotated[list[str] | None, Parameter("--set", metavar="KEY=VALUE")] = None,
) -> None:
    """Write a new data set.

    Args:
        folder: The folder to write.
        files: Files that you measured: they are copied into FOLDER, with a cable.toml that fits them.
        example: Write a data set that comes with bowdenfit; without a name, list them.
        notebook: With an example: write a notebook that fits it beside it.
        wrap_angle: With one file: its wrap angle, as of fit, such as 180deg. Nothing is asked then.
        columns: With one file: which column is what, as of fit; may be repeated.
        channels: With one file: which channel of a recording is what, as of fit; may be repeated.
        settings: With one file: a setting of cable.toml, as of fit; may be repeated.
    """
    named = {"wrap_angle": wrap_angle, "columns": columns, "channels": channels, "settings": settings}
    reading = {name: value for name, value in named.items() if value}
    _init_dialog().start_data_set(folder, files or [], example, reading, notebook)


def _examples() -> list[str]:
    return list(_init_dialog().find_examples())


def _init_dialog() -> ModuleType:
    """Return the module that starts data sets, imported when first used, because it loads NumPy and `--help` does not."""
    from bowdenfit.cli import init_dialog

    return init_dialog


_HELP = """Friction coefficients of a Bowden cable from bench measurements.

With honest uncertainty, and the cable length that transmits force best.

Start with `bowdenfit init FOLDER`, fill in the files, `bowdenfit check FOLDER`,
then `bowdenfit fit FOLDER`.

Exit codes: 0 done (a fit has converged); 1 failure; 2 bad usage or bad input;
3 the fit finished but must not be trusted; 130 interrupted, with the checkpoint
kept.
"""
_COMPLETION = """Print the completion script of a shell.

For bash: eval "$(bowdenfit completion bash)"
"""


def _completion(shell: Annotated[Literal["bash", "zsh", "fish"], Parameter("SHELL", help="Such as bash.")], /) -> None:
    say(bowdenfit.generate_completion(shell=shell))


def _version() -> str:
    return f"bowdenfit, version {version('bowdenfit')}"


bowdenfit = App(name="bowdenfit", help=_HELP, version=_version, **LOOK)
COMMANDS = (
    App(name="init", help=INIT_HELP, default_command=init, **LOOK),
    *map(command, VERBS),
    App(name="completion", help=_COMPLETION, default_command=_completion, **LOOK),
)
for position, verb in enumerate(COMMANDS):
    verb.sort_key = position
    bowdenfit.command(verb)
