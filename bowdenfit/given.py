"""What functions are given by their callers: taken as it is meant, or refused in a sentence.

A notebook writes `input_force="50N"`, `wrap_angles=(90, "deg")` or an array of lengths, and each is clear. A force without its
unit, a name that is none, or the folder of a fit in place of the fit is not, and would end deep inside, in words of Python's.
"""

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial, wraps
from inspect import Parameter, signature
from numbers import Integral, Number, Real
from os import PathLike
from pathlib import Path
from types import NoneType
from typing import Annotated, Any, Literal, TypeVar, Unpack, cast, get_args, get_origin, get_type_hints

from bowdenfit.errors import UsageError
from bowdenfit.verb import Argument, Length, Option, Quantity, kinds_of
from bowdenfit.words import shown

_NUMBER = r"(?P<value>[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)"
_LENGTH = re.compile(_NUMBER + r"\s*(?P<unit>[^\W\d][^\s]*)?(?=\s|$)")
_QUANTITY = re.compile(_NUMBER + r"\s*(?P<unit>(?!\.|[eE]\d)\D.*)", re.ASCII)
Function = TypeVar("Function", bound=Callable[..., Any])
Reader = Callable[[Any], Any]  # what the function takes, of what it is given


def with_checked_keywords(function: Function) -> Function:
    """A function that reads its arguments first, as their types and options say.

    Args:
        function: Annotated as `bowdenfit.verb` says.
    """
    stated = signature(function)
    readers = {name: reader for each in stated.parameters.values() for name, reader in _readers(each)}
    record = next((name for name, each in stated.parameters.items() if each.kind is Parameter.VAR_KEYWORD), "")
    needed = {name for name, each in stated.parameters.items() if each.default is Parameter.empty}

    @wraps(function)
    def checked(*arguments: Any, **keywords: Any) -> Any:
        given = stated.bind(*arguments, **keywords)
        for named in (given.arguments, given.arguments.get(record, {})):
            said = {name: value for name, value in named.items() if value is not None or name in needed}
            named |= {name: readers[name](value) for name, value in said.items() if name in readers}
        return function(*given.args, **given.kwargs)

    return cast("Function", checked)


def _readers(parameter: Parameter) -> Iterator[tuple[str, Reader]]:
    """Of a parameter, or of the keywords of a record; choices of a description are left to what reads it."""
    annotation = parameter.annotation
    if get_origin(annotation) is Unpack:
        (record,) = get_args(annotation)
        for name, each in get_type_hints(record, include_extras=True).items():
            yield from _reader(name, each, choices=False)
    else:
        yield from _reader(parameter.name, annotation, choices=True)


def _reader(name: str, annotation: Any, choices: bool) -> Iterator[tuple[str, Reader]]:
    if get_origin(annotation) is not Annotated:
        return
    kind, mark = annotation.__origin__, annotation.__metadata__[0]
    kinds = kinds_of(kind)
    if isinstance(mark, Argument) and mark.results and "Path" not in str(kind):  # a fit alone
        yield name, partial(_fits if mark.many else _fit, name)
    elif Sequence[Length] in kinds:
        yield name, partial(_lengths, name)
    elif isinstance(mark, Argument) or (set(kinds) <= {str, Path, NoneType} and Path in kinds):
        yield name, partial(_place, name)
    elif isinstance(mark, Option):
        named = [get_args(each) for each in kinds if get_origin(each) is Literal]
        if Quantity in kinds:
            yield name, partial(_quantity, name, mark.example)
        elif Sequence[Quantity] in kinds:
            yield name, partial(_quantities, name, mark.example)
        elif Sequence[str] in kinds:
            yield name, partial(_texts, name)
        elif int in kinds:
            yield name, partial(_whole_number, name, mark)
        elif named and choices:
            yield name, partial(_choice, name, named[0])


def _quantity(name: str, example: str, given: Any) -> Quantity:
    if isinstance(given, str):
        return read_quantity(given, name, example)
    if _is_quantity(given) and math.isfinite(given[0]):
        return float(given[0]), given[1]
    number, unit = read_quantity(example, name, example)
    raise UsageError(
        f"{name} = {shown(given)} is not a number with its unit; write it as {example!r}, or as ({number:g}, {unit!r})."
    )


def _quantities(name: str, example: str, given: Any) -> list[Quantity]:
    several = isinstance(given, Sequence) and not isinstance(given, str) and not _is_quantity(given)
    return [_quantity(name, example, each) for each in (given if several else [given])]


def _is_quantity(given: Any) -> bool:
    return isinstance(given, tuple | list) and len(given) == 2 and isinstance(given[0], Real) and isinstance(given[1], str)


def _lengths(name: str, given: Any) -> list[Length]:
    several = isinstance(given, Iterable) and not isinstance(given, str) and not _is_quantity(given)
    found = list[Length]()
    for each in given if several else [given]:
        if isinstance(each, str):
            found += read_lengths([each], name)
        elif _is_quantity(each):
            found.append((float(each[0]), each[1]))
        elif isinstance(each, Real):
            found.append(float(each))
        else:
            raise UsageError(f"{name} = {shown(given)} are no lengths; write them as [455, 470], or ['18 in'].")
    if not found:
        raise UsageError(f"{name} = {shown(given)} names no length; name some, or leave it out where all are meant.")
    return found


def _texts(name: str, given: Any) -> Sequence[str]:
    if isinstance(given, str):
        return (given,)
    if isinstance(given, Iterable) and not isinstance(given, Mapping):
        several = tuple(given)
        if all(isinstance(each, str) for each in several):
            return several
    raise UsageError(f"{name} = {shown(given)} is no list of texts; write it as ['name=value'].")


def _whole_number(name: str, mark: Option, given: Any) -> int:
    number = int(given) if isinstance(given, Integral) and not isinstance(given, bool) else None
    below = number is not None and mark.least is not None and number < mark.least
    if number is None or below or (mark.most is not None and number > mark.most):
        ends = [f" {word} {end}" for word, end in (("from", mark.least), ("to", mark.most)) if end is not None]
        raise UsageError(f"{name} = {shown(given)} is no whole number{''.join(ends)}; write one.")
    return number


def _choice(name: str, choices: Sequence[str], given: Any) -> str:
    if given not in choices:
        raise UsageError(f"{name} = {shown(given)} is unknown; choose one of {', '.join(choices)}.")
    return str(given)


def _place(name: str, given: Any) -> Any:
    """A path, or what was read from one, which is nothing that Python itself has."""
    if isinstance(given, Number | bytes | list | tuple | dict | NoneType):
        raise UsageError(f"{name} = {shown(given)} is neither a path nor what bowdenfit has read; write it as 'my-cable'.")
    return given


def _fit(name: str, given: Any) -> Any:
    if isinstance(given, str | PathLike):
        raise UsageError(f"{name} is the fit itself; write bowdenfit.load({str(given)!r}) instead of the folder's name.")
    return _place(name, given)


def _fits(name: str, given: Any) -> Any:
    if not isinstance(given, Mapping):
        raise UsageError(f"{name} are the fits by names of yours; write them as {{'one': fit, 'another': other}}.")
    return {each: _fit(f"{name}[{each!r}]", fit) for each, fit in given.items()}


def read_quantity(text: str, option: str, example: str) -> Quantity:
    """A number with its unit, such as 180deg or "100 N".

    Args:
        text: As written.
        option: Of which.
        example: How it is written right.

    Raises:
        UsageError: It is something else.
    """
    match = _QUANTITY.fullmatch(text.strip())
    value, unit = (float(match["value"]), match["unit"]) if match else (0.0, "")
    if not unit or not math.isfinite(value):
        raise UsageError(f"{option} {shown(text)} is not a number with its unit; write it as {example}.")
    return value, unit


def read_lengths(given: Sequence[str], name: str) -> list[Length]:
    """Numbers, each with its unit where one stands behind it, as in 455 455mm 18 in.

    Args:
        given: As written, a unit perhaps by itself.
        name: Of the argument.

    Raises:
        UsageError: Something is no number.
    """
    found, text = list[Length](), " ".join(given)
    while text := text.strip():
        match = _LENGTH.match(text)
        if match is None:
            raise UsageError(f"{name} {shown(text.split()[0])} is no number; write lengths as 455, 455mm or 18 in.")
        value, unit = float(match["value"]), match["unit"]
        found.append((value, unit) if unit else value)
        text = text[match.end() :]
    return found
