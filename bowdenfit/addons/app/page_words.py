"""Sentences of the command line as a page says them: without commands and options of a shell, and keys of a terminal."""

import re
from collections.abc import Callable
from html import escape, unescape

from bowdenfit.words import shown

_SOURCE = re.compile(r"(?<![\w'\"-])--(column|channel) (\w[\w.]*)=('[^']*'|[^\s,;)]+?)(?=[\s,;)]|\.?$|\.\s)")
_MISSING = re.compile(r"(?<![\w'\"-])--missing \S+ \(in cable\.toml (missing = \[[^\]]*\])([^)]*)\)")
_VALUE = re.compile(r"(?<![\w'\"-])--(wrap-angle|sheet|join) (?!states|and|names|is |or )(\S+?)(?=[\s,;.)]|$)")
_SETTING = re.compile(r"(?<![\w'\"-])--(?:set (\w[\w.]*)=|(friction|noise|geometry) )(?!states|and|or )([\w-]+)")
_OPTION = re.compile(r"(?<![\w'\"-])--([a-z]+(?:-[a-z]+)*)")
_NAMES = {
    "column": "the menu of a column", "channel": "the menu of a channel", "wrap-angle": "the wrap angle", "sheet": "the sheet",
    "join": "output_file", "reading-limit": "the reading limit", "output": "another name", "missing": "missing",
}  # fmt: skip
_PLACES = {
    "check": "'What was measured' on the page of the data set", "compare": "'Compare two fits' at the start",
    "fit": "'Fit' on the page of the data set", "identify": "'Coefficients' on the page of the fit",
    "init": "'New data set' at the start", "next": "'Measure more, or stop'", "predict": "'What arrives'",
    "summary": "the page of the fit", "watch": "'Live' on the page of the data set",
}  # fmt: skip
_COMMAND = re.compile(rf"`?\bbowdenfit ({'|'.join(_PLACES)})\b(?: --full| FOLDER| FILE)?`?")
_KEYS = {"friction": "friction_model"}  # of options that have another name in cable.toml
_NEXT_SOURCE = re.compile(r"( as \w+(?: in \S+)?) (?=(?:column|channel) ')")
_HTML = re.compile(r"(<(script|style)\b.*?</\2>|<[^>]*>)", re.DOTALL)
_WHOLE: tuple[tuple[str, str], ...] = (
    ("Everything else: bowdenfit summary --full", ""),
    (": bowdenfit summary --full]", ": on the page of the fit]"),
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
        (_NEXT_SOURCE, lambda match: f"{match[1]} and "),
        (_SETTING, _name_setting),
        (_COMMAND, lambda match: _PLACES[match[1]]),
        (_VALUE, lambda match: f"{_NAMES[match[1]]} {match[2]}"),
        (_OPTION, lambda match: _NAMES.get(match[1], match[1].replace("-", " "))),
    )
    for pattern, replacement in rules:
        sentence = pattern.sub(replacement, sentence)
    return sentence


def page_html(html: str) -> str:
    """Return HTML whose text is as a page says it; tags, scripts and styles stay.

    Args:
        html: What renders an answer for a page.
    """
    pieces = _HTML.split(html)  # text, tag, the name of a script or style, text, ...
    words = [escape(page_words(unescape(piece)), quote=False) if "bowdenfit " in piece or "--" in piece else piece
             for piece in pieces[::3]]  # fmt: skip
    return "".join(f"{word}{tag or ''}" for word, tag in zip(words, [*pieces[1::3], ""], strict=True))


def _name_setting(match: re.Match[str]) -> str:
    """Return a setting as cable.toml has it."""
    key, option, value = match.groups()
    return f'{key or _KEYS.get(option, option)} = "{value}"'


def _name_source(match: re.Match[str]) -> str:
    """Return what a column or channel is to be read as, as the menus of a page call it."""
    kind, quantity, source = match.groups()
    heading, colon, unit = source.strip("'").rpartition(":")
    return f"{kind} {shown(heading if colon else unit)} as {quantity}" + (f" in {unit}" if colon else "")
