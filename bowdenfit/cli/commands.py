"""A verb as a command: its options from the keywords of its function, its output from the reply."""

import inspect
import json
import os
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from bowdenfit.cli.explained import Explained
from bowdenfit.cli.keywords import Keyword, keywords_of
from bowdenfit.cli.progress import watch_verb
from bowdenfit.cli.terminal import say
from bowdenfit.errors import UsageError
from bowdenfit.verb import NOT_TRUSTED, Argument, Reply, Verb

if TYPE_CHECKING:
    from bowdenfit.front_desk import Fit


def command(verb: Verb) -> click.Command:
    """The command of a verb.

    Args:
        verb: What it does; see `bowdenfit.verb`.
    """
    keywords = keywords_of(verb.function)
    parameters = [keyword.parameter() for keyword in keywords]
    for form, words in (("csv", verb.csv), ("json", verb.json)):
        if words:
            parameters.append(click.Option([f"--{form}", f"as_{form}"], is_flag=True, help=words))

    def run(as_json: bool = False, as_csv: bool = False, **given: Any) -> int:
        if as_json and as_csv:
            raise UsageError("--json and --csv are two forms of the same answer; name one of them.")
        return _run(verb, keywords, given, "json" if as_json else "csv" if as_csv else "")

    name = verb.name or verb.function.__name__
    return Explained(name, callback=run, params=parameters, help=verb.text, short_help=verb.short)


def _run(verb: Verb, keywords: tuple[Keyword, ...], given: dict[str, Any], form: str) -> int:
    """Ask, and print the reply for people, or as "json" or "csv"."""
    asked = {keyword.name: keyword.value(given[keyword.name]) for keyword in keywords}
    source = given[keywords[0].name] if keywords else None
    answers = _kept(source) if isinstance(source, Path) and (verb.kept or verb.warns) else {}
    reply = _read_back(verb, answers, asked)
    if reply is None or (form == "json" and reply.page is None) or (form == "csv" and reply.csv is None):
        reply = _answer(verb, keywords, given, asked)
    if verb.warns and isinstance(source, Path):
        troubles = answers["troubles"] if "troubles" in answers else _troubles(asked[keywords[0].name], source)
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


def _answer(verb: Verb, keywords: tuple[Keyword, ...], given: dict[str, Any], asked: dict[str, Any]) -> Reply:
    """The reply, worked out."""
    found = next((k.name for k in keywords if isinstance(k.mark, Argument) and k.mark.results), None)
    if found is not None:
        asked[found] = _loaded(given[found])
    if verb.results and asked["output"] is None:
        asked["output"] = Path(verb.results) / _name_of(Path(asked[keywords[0].name]))
    if asked.get("output") is not None:
        from bowdenfit.results.folder import refuse_unwritable

        refuse_unwritable(asked["output"])
    if "report" in inspect.signature(verb.function).parameters:
        asked["report"] = lambda sentence: say(sentence, err=True)
    if verb.watch is None:
        answer = verb.function(**asked)
    else:
        with watch_verb(asked["output"], verb.watch) as progress:
            answer = verb.function(**asked, progress=progress)
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
