"""Sentences of the command line as a page says them: without options of a shell, and without keys of a terminal."""

import re
from collections.abc import Callable

from bowdenfit.words import shown

_SOURCE = re.compile(r"(?<![\w'\"-])--(column|channel) (\w[\w.]*)=('[^']*'|[^\s,;)]+?)(?=[\s,;)]|\.?$|\.\s)")
_MISSING = re.compile(r"(?<![\w'\"-])--missing \S+ \(in cable\.toml (missing = \[[^\]]*\])([^)]*)\)")
_VALUE = re.compile(r"(?<![\w'\"-])--(wrap-angle|sheet|join) (?!states|and|names|is |or )(\S+?)(?=[\s,;.)]|$)")
_OPTION = re.compile(r"(?<![\w'\"-])--([a-z]+(?:-[a-z]+)*)")
_NAMES = {
    "column": "the menu of a column", "channel": "the menu of a channel", "wrap-angle": "the wrap angle", "sheet": "the sheet",
    "join": "output_file", "reading-limit": "the reading limit", "output": "another name", "missing": "missing",
}  # fmt: skip
_WHOLE: tuple[tuple[str, str], ...] = (
    ("; or run this in a terminal, which asks", ""),
    ("; Ctrl-C ends it", ""),
    ("; add --force to replace it, or name another with --output", "; give this one another name"),
    ("; go on with --resume, or start over with --force", "; open it to resume it, or give this one another name"),
    ("; name another with --output", "; give this one another name"),
    ("wait for it, or name another folder with --output", "wait for it, or give this one another name"),
    (", or allow more with --reading-limit 4", ""),
)


def page_words(sentence: str) -> str:
    """Return a sentence without what only a shell or a terminal understands.

    Args:
        sentence: As the command line prints it; names of files in it stand in quotation marks, and stay.
    """
    for printed, on_page in _WHOLE:
        sentence = sentence.replace(printed, on_page)
    rules: tuple[tuple[re.Pattern[str], Callable[[re.Match[str]], str]], ...] = (
        (_MISSING, lambda match: f"{match[1]}{match[2]} in cable.toml"),
        (_SOURCE, _name_source),
        (_VALUE, lambda match: f"{_NAMES[match[1]]} {match[2]}"),
        (_OPTION, lambda match: _NAMES.get(match[1], match[1].replace("-", " "))),
    )
    for pattern, replacement in rules:
        sentence = pattern.sub(replacement, sentence)
    return sentence


def _name_source(match: re.Match[str]) -> str:
    """Return what a column or channel is to be read as, as the menus of a page call it."""
    kind, quantity, source = match.groups()
    heading, colon, unit = source.strip("'").rpartition(":")
    return f"{kind} {shown(heading if colon else unit)} as {quantity}" + (f" in {unit}" if colon else "")
