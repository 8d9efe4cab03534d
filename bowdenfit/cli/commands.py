"""A verb as a command: the parameters of its function as arguments and options, and its answer as what is printed."""

import json
import os
from collections.abc import Collection
from dataclasses import replace
from inspect import Parameter as Stated
from inspect import Signature, unwrap
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args, get_origin

from cyclopts import App, CycloptsError, Group, MissingArgumentError, Parameter, UnusedCliTokensError
from cyclopts.help import DefaultFormatter, PanelSpec
from docstring_parser.google import parse
from rich.box import Box

from bowdenfit.arguments import FIT, FITS, Declared, parameters_of, read_arguments
from bowdenfit.cli.progress import watch_verb
from bowdenfit.cli.terminal import say
from bowdenfit.errors import UsageError
from bowdenfit.reading import Reading
from bowdenfit.verb import NOT_TRUSTED, Reply, Verb
from bowdenfit.words import listed

if TYPE_CHECKING:
    from bowdenfit.front_desk import Fit


LOOK: dict[str, Any] = {  # of every command
    "default_parameter": Parameter(negative=(), show_default=False, allow_repeating=True, json_list=False, json_dict=False),
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


def command(verb: Verb) -> App:
    """Return the command of a verb: a function with the signature that cyclopts reads, which asks the verb.

    Args:
        verb: What it does; see `bowdenfit.verb`.
    """
    written = _written_signature(verb)

    def run(*arguments: Any, **options: Any) -> int:
        asked = written.bind(*arguments, **options).arguments
        forms = [form for form in ("json", "csv") if asked.pop(form, False)]
        if len(forms) == 2:
            raise UsageError("--json and --csv are two forms of the same answer; name one of them.")
        return _run(verb, asked, "".join(forms))

    run.__annotations__, vars(run)["__signature__"] = {}, written
    return App(name=verb.name or verb.function.__name__, help=verb.text, default_command=run, **LOOK)


def _written_signature(verb: Verb) -> Signature:
    """The parameters of a verb's function as they are written, and --csv and --json."""
    described = [*parse(Reading.__doc__ or "").params, *parse(verb.function.__doc__ or "").params]
    words = {each.arg_name: " ".join((each.description or "").split()) for each in described}
    declared = parameters_of(verb.function).items()
    parameters = [_written(each, words.get(name)) for name, each in declared if each.option.parse is not False]
    for form, meaning in (("csv", verb.csv), ("json", verb.json)):
        if meaning:
            annotation = Annotated[bool, Parameter(help=meaning)]
            parameters.append(Stated(form, Stated.KEYWORD_ONLY, default=False, annotation=annotation))
    return Signature(parameters)


def _written(declared: Declared, words: str | None) -> Stated:
    """A parameter as it is written: by its place if its name is in capitals, else by name; as text if a reader reads it."""
    type_, default = declared.type, declared.plain.default
    about, by_place = [Parameter(help=words)], declared.written_name.isupper()
    kind = Stated.POSITIONAL_ONLY if by_place else Stated.KEYWORD_ONLY
    if declared.reader:
        type_ = declared.reader.written
    elif choices := [each for each in (type_, *get_args(type_)) if get_origin(each) is Literal]:
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


def refusal(error: CycloptsError) -> str:
    """Return what to say of a command that cannot be understood."""
    see = f"See {' '.join(['bowdenfit', *(error.command_chain or ())])} --help."
    if isinstance(error, UnusedCliTokensError):
        return f"There is no place for {listed(error.unused_tokens or [])}. {see}"
    if isinstance(error, MissingArgumentError) and error.argument is not None and error.argument.index is not None:
        name, words = error.argument.name, error.argument.parameter.help or ""
        dots, many = ("...", "some") if get_origin(error.argument.hint) is tuple else ("", "one")
        return f"Missing argument '{name}{dots}'. Name {many}, {words[:1].lower()}{words[1:]}"
    return f"{error} {see}"


def _run(verb: Verb, given: dict[str, Any], form: str) -> int:
    """Ask, and print the reply for people, or as "json" or "csv"."""
    declared = {name: each for name, each in parameters_of(verb.function).items() if each.option.parse is not False}
    asked = {name: each.plain.default for name, each in declared.items()} | given
    first, source = next(iter(asked.items()))
    is_of_fit = declared[first].reader in (FIT, FITS)
    texts = {name: value for name, value in asked.items() if declared[name].reader not in (None, FIT, FITS)}
    asked |= read_arguments(verb.function, texts, typed=True)
    answers = _kept(source) if isinstance(source, Path) and (verb.kept or verb.warns) else {}
    reply = _read_back(verb, answers, asked)
    if reply is None or (form == "json" and reply.page is None) or (form == "csv" and reply.csv is None):
        asked[first] = _loaded(source) if is_of_fit else source
        reply = _answer(verb, asked, source)
    if verb.warns and isinstance(source, Path):
        troubles = answers["troubles"] if "troubles" in answers else _troubles(asked[first], source)
        reply = _with_warning(reply, [trouble for trouble in troubles if trouble != verb.explains], source)
    say(_page(reply) if form == "json" else reply.csv() if form == "csv" and reply.csv else reply.text, nl=False)
    for note in reply.notes:
        say(note, err=True)
    return reply.exit_code


def _kept(source: Path) -> dict[str, Any]:
    """What the fit of a results folder has answered before."""
    from bowdenfit.results.kept import kept

    return kept(source)


def _read_back(verb: Verb, answers: dict[str, Any], asked: dict[str, Any]) -> Reply | None:
    """The reply where a fit has answered just this before."""
    try:
        return verb.kept(answers, asked) if verb.kept and answers else None
    except (LookupError, TypeError, ValueError, AttributeError):  # kept when the answer had another shape
        return None


def _answer(verb: Verb, asked: dict[str, Any], source: Any) -> Reply:
    """The reply, worked out."""
    if verb.results and asked["output"] is None:
        asked["output"] = Path(verb.results) / _name_of(source)
    if asked.get("output") is not None:
        from bowdenfit.results.folder import refuse_unwritable

        refuse_unwritable(asked["output"])
    function = unwrap(verb.function)  # whose arguments have been read
    if "report" in parameters_of(function):
        asked["report"] = lambda sentence: say(sentence, err=True)
    if verb.watch is None:
        answer = function(**asked)
    else:
        with watch_verb(asked["output"], verb.watch) as progress:
            answer = function(**asked, progress=progress)
    return verb.reply(answer, asked)


def _troubles(found: Any, source: Path) -> Collection[str]:
    """Why a fit is not to be trusted, worked out; nothing where the source is no fit.

    Args:
        found: The fit, where it has been loaded.
        source: Its results folder, or what else a verb may be asked of.
    """
    from bowdenfit.results.folder import FIT

    if found is source and (source / FIT).exists():
        found = _loaded(source)
    return () if isinstance(found, Path) else tuple(found.verdict().troubles)


def _with_warning(reply: Reply, troubles: Collection[str], results: Path) -> Reply:
    """A reply that says beside the answer, and by its exit code, where a fit is not to be trusted."""
    said = f"Warning: this fit is {' and '.join(troubles)}; see bowdenfit summary {results}."
    return replace(reply, notes=(*reply.notes, said), exit_code=reply.exit_code or NOT_TRUSTED) if troubles else reply


def _page(reply: Reply) -> str:
    """An answer as JSON."""
    from bowdenfit.results.plain import plain

    return json.dumps(plain(reply.page()), indent=1, allow_nan=False) + "\n" if reply.page else reply.text


def _loaded(results: Path | tuple[Path, ...]) -> "Fit | dict[str, Fit]":
    """The fit of a results folder; of several, by their own names, or from where their paths part where two have the same."""
    from bowdenfit.front_desk import load

    if isinstance(results, Path):
        return load(results)
    names = [folder.name for folder in results]
    paths = [folder.resolve() for folder in results]
    above = Path(os.path.commonpath(paths)) if len(set(paths)) > 1 else Path(paths[0].anchor)
    return {
        name if names.count(name) == 1 or path == above else str(path.relative_to(above)): load(folder)
        for name, path, folder in zip(names, paths, results, strict=True)
    }


def _name_of(dataset: Path) -> str:
    """What the results of a data set are called if nothing else is said."""
    return dataset.stem if dataset.suffix else dataset.resolve().name
