"""Arguments of verbs: texts with units, lists, folders and fits, read and checked before the function sees them.

A notebook writes `input_force="50N"`, `wrap_angles=(90, "deg")` or an array of lengths, a shell `--input-force 50N`, and each
is clear. A force without its unit, or the folder of a fit in place of the fit, is not, and would end deep inside, in words of
Python's. So the annotation of a parameter declares everything once: a type, which is what callers may write and what pydantic
checks; a `Reader`, where it takes more to read that; and a `Parameter` of cyclopts, where the command line needs more than the
name.

    def predict(fit: Annotated["Record", RESULTS, FIT], preload: Annotated[Quantity | None, number_with_unit("20N")] = None):

Types that take long to load are quoted, and never evaluated here. Nor is pydantic loaded before a call needs it.
"""

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import wraps
from inspect import Parameter as Stated
from inspect import cleandoc, signature, unwrap
from numbers import Integral, Number, Real
from os import PathLike
from pathlib import Path
from types import NoneType
from typing import Annotated, Any, ForwardRef, Literal, TypeAlias, TypeVar, cast, get_args, get_origin, get_type_hints

from cyclopts import Parameter

from bowdenfit.errors import UsageError, suggest_name
from bowdenfit.words import shown

NumberWithUnit: TypeAlias = tuple[float, str]
Quantity: TypeAlias = str | NumberWithUnit  # as callers write it: "50N", or (50, "N")
Length: TypeAlias = float | Quantity  # a number without a unit is one of the route's
Stroke: TypeAlias = Literal["pull", "return"]
LARGEST_SEED = 2**31 - 1
_NUMBER = r"(?P<value>[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)"
_FLOAT, _WHOLE = re.compile(_NUMBER), re.compile(r"[+-]?[0-9]{1,18}")
_LENGTH = re.compile(_NUMBER + r"\s*(?P<unit>[^\W\d][^\s]*)?(?=\s|$)")
_IN_RECORD = re.compile(r"^ +reading: .*\n", re.MULTILINE)
_QUANTITY = re.compile(_NUMBER + r"\s*(?P<unit>(?!\.|[eE]\d)\D.*)", re.ASCII)
Function = TypeVar("Function", bound=Callable[..., Any])


@dataclass(frozen=True)
class Reader:
    """Reads an argument whose type alone does not say how.

    Args:
        read: Returns the argument as the function takes it, from what was written and the name to call it by in a refusal.
        command_line_type: Type of the text on the command line, which `read` accepts too.
    """

    read: Callable[[Any, str], Any]
    command_line_type: Any = str


@dataclass(frozen=True)
class Declared:
    """What a function declares about one of its parameters.

    Args:
        plain: Its name, kind, default and type, as help and notebooks show it; a type that takes long to load is a text.
        reader: How it is read; by its type if None.
        option: How it is written on the command line.
    """

    plain: Stated
    reader: Reader | None
    option: Parameter

    @property
    def type(self) -> Any:
        """The type; `Any` for one that takes long to load and is given as text."""
        return Any if isinstance(self.plain.annotation, str) else self.plain.annotation

    @property
    def written_name(self) -> str:
        """The name on the command line: DATASET, or --wrap-angle."""
        return next(iter(self.option.name or ()), f"--{self.plain.name.replace('_', '-')}")


def parameters_of(function: Callable[..., Any]) -> dict[str, Declared]:
    """Return what a function declares of its parameters; of those in a record of keywords (`**reading`) each by itself."""
    parameters = dict(signature(unwrap(function)).parameters)
    if "reading" in parameters:
        (record,) = get_args(parameters.pop("reading").annotation)
        hints = get_type_hints(record, include_extras=True)
        parameters |= {name: Stated(name, Stated.KEYWORD_ONLY, annotation=hint, default=None) for name, hint in hints.items()}
    return {name: _read_declaration(declared) for name, declared in parameters.items()}


def _read_declaration(parameter: Stated) -> Declared:
    is_annotated = get_origin(parameter.annotation) is Annotated
    type_, *marks = get_args(parameter.annotation) if is_annotated else (parameter.annotation,)
    type_ = type_.__forward_arg__ if isinstance(type_, ForwardRef) else type_
    reader = next((mark for mark in marks if isinstance(mark, Reader)), None)
    default = () if reader in (TEXTS, CODES) else parameter.default
    option = Parameter.combine(*(mark for mark in marks if isinstance(mark, Parameter)))
    return Declared(parameter.replace(annotation=type_, default=default), reader, option)


def read_first(function: Function) -> Function:
    """Return a function that reads its arguments first, as their annotations say.

    Its signature is the one that help and notebooks show: plain types, and each keyword of a record by name.

    Args:
        function: Annotated as the module says.
    """
    stated = signature(function)

    @wraps(function)
    def call(*arguments: Any, **keywords: Any) -> Any:
        bound = stated.bind(*arguments, **keywords).arguments
        return function(**read_arguments(function, bound.pop("reading", {}) | bound))

    plain = [each.plain for each in parameters_of(function).values()]
    vars(call)["__signature__"] = stated.replace(parameters=plain)
    if "reading" in stated.parameters:
        (record,) = get_args(stated.parameters["reading"].annotation)
        call.__doc__ = _IN_RECORD.sub(_list_arguments(record).replace("\\", r"\\"), function.__doc__ or "")
    return cast("Function", call)


def _list_arguments(record: type) -> str:
    """Return the lines in which a record of keywords says what they are, as they stand below Args."""
    return "\n".join(f"    {line}" for line in cleandoc(record.__doc__ or "").partition("Args:\n")[2].splitlines()) + "\n"


def read_arguments(function: Callable[..., Any], arguments: Mapping[str, Any], typed: bool = False) -> dict[str, Any]:
    """Return arguments as a function takes them: by their reader, else by their type.

    Args:
        function: Whose parameters they are for.
        arguments: By the names of the parameters; what is the default is left as it is.
        typed: Whether refusals call them as the command line does.

    Raises:
        UsageError: One cannot be read, or there is no such parameter.
    """
    parameters, values = parameters_of(function), dict(arguments)
    for name, value in arguments.items():
        if name not in parameters:
            raise UsageError(f"there is no keyword {name!r}{suggest_name(name, list(parameters))}")
        declared = parameters[name]
        if value is not declared.plain.default:
            called = declared.written_name if typed else name
            values[name] = declared.reader.read(value, called) if declared.reader else _validate(declared.type, value, called)
    return values


def _validate(type_: Any, value: Any, name: str) -> Any:
    """Return the value as pydantic converts it to a type."""
    import pydantic  # here, because `--help` does not load it

    try:
        return pydantic.TypeAdapter(type_, config=pydantic.ConfigDict(arbitrary_types_allowed=True)).validate_python(value)
    except pydantic.ValidationError as error:
        (fault, *_) = error.errors()
        if fault["type"] == "literal_error":
            choices = fault["ctx"]["expected"].replace("'", "").replace(" or ", ", ")
            raise UsageError(f"{name} = {shown(value)} is unknown; choose one of {choices}.") from None
        raise UsageError(f"{name} = {shown(value)} cannot be used: {fault['msg'][:1].lower()}{fault['msg'][1:]}.") from None


def number_with_unit(example: str) -> Reader:
    """Return what reads a number with its unit, such as the example."""

    def read(value: Any, name: str) -> NumberWithUnit:
        if isinstance(value, str):
            return read_quantity(value, name, example)
        if _is_number_with_unit(value) and math.isfinite(value[0]):
            return float(value[0]), value[1]
        example_value, unit = read_quantity(example, name, example)
        example_pair = f"({example_value:g}, {unit!r})"
        raise UsageError(
            f"{name} = {shown(value)} is not a number with its unit; write it as {example!r}, or as {example_pair}."
        )

    return Reader(read)


def numbers_with_units_by_name(example: str, named: str) -> Reader:
    """Return what reads numbers with their units, each by a name or by none, as pairs of name ("" for none) and number.

    Args:
        example: One without a name, such as 90deg.
        named: One with a name, such as edge=45deg.
    """
    read = number_with_unit(example).read

    def read_item(item: Any, name: str) -> tuple[str, NumberWithUnit]:
        if not (isinstance(item, str) and "=" in item):
            return "", read(item, name)
        key, _, number = item.rpartition("=")
        if not key.strip():
            raise UsageError(f"{name} {shown(item)} has no name before its '='; write it as {named!r}, or as {example}.")
        return key.strip(), read(number, f"{name} {key.strip()!r},")

    def read_all(value: Any, name: str) -> list[tuple[str, NumberWithUnit]]:
        if not isinstance(value, Mapping):
            return [read_item(item, name) for item in _as_list(value)]
        return [(str(key), read(number, f"{name}[{key!r}]")) for key, number in value.items()]

    return Reader(read_all, list[str])


def numbers_by_name(example: str, called: str = "kind") -> Reader:
    """Return what reads numbers by names, which the command line writes as the example.

    Args:
        example: One of them.
        called: What the names are of.
    """

    def read(text: str, name: str) -> tuple[str, float]:
        key, _, number = text.partition("=")
        if not _FLOAT.fullmatch(number.strip()):
            raise UsageError(f"{name} {shown(text)} is not a {called} and a number; write it as {example}.")
        return key.strip(), float(number)

    return Reader(
        lambda value, name: dict(
            value if isinstance(value, Mapping) else [read(text, name) for text in _read_texts(value, name)]
        ),
        list[str],
    )


def whole_number(least: int, most: float = math.inf) -> Reader:
    """Return what reads a whole number between limits."""

    def read(value: Any, name: str) -> int:
        is_whole = isinstance(value, Integral) and not isinstance(value, bool)
        is_text = isinstance(value, str) and _WHOLE.fullmatch(value)
        if (is_whole or is_text) and least <= int(value) <= most:
            return int(value)
        limits = f" from {least}" + (f" to {most}" if most < math.inf else "")
        raise UsageError(f"{name} = {shown(value)} must be a whole number{limits}.")

    return Reader(read)


def _as_list(value: Any) -> list[Any]:
    """Return the value as a list; a text, or a number with its unit, is one item."""
    is_one = isinstance(value, str) or _is_number_with_unit(value) or not isinstance(value, Iterable)
    return [value] if is_one else list(value)


def _is_number_with_unit(value: Any) -> bool:
    is_pair = isinstance(value, tuple | list) and len(value) == 2
    return is_pair and isinstance(value[0], Real) and isinstance(value[1], str)


def _read_lengths(value: Any, name: str) -> list[float | NumberWithUnit]:
    lengths = _as_list(value)
    if not lengths:
        raise UsageError(f"{name} = {shown(value)} names no length; name some, or leave it out to use all.")
    if not all(isinstance(item, str | Real) or _is_number_with_unit(item) for item in lengths):
        raise UsageError(f"{name} = {shown(value)} must be lengths, such as [455, 470] or ['18 in'].")
    if all(isinstance(item, str) for item in lengths):  # of which a unit may be one by itself
        return read_lengths(lengths, name)
    read = [read_lengths([item], name) if isinstance(item, str) else [_number_or_pair(item)] for item in lengths]
    return [length for some in read for length in some]


def _number_or_pair(value: Any) -> float | NumberWithUnit:
    return float(value) if isinstance(value, Real) else (float(value[0]), value[1])


def _read_texts(value: Any, name: str) -> Sequence[str]:
    texts = tuple(_as_list(value))
    if isinstance(value, Mapping) or not all(isinstance(text, str) for text in texts):
        raise UsageError(f"{name} = {shown(value)} must be a list of texts, such as ['name=value'].")
    return texts


def _read_codes(value: Any, name: str) -> Sequence[str]:
    """Return codes as texts; numbers are codes too."""
    codes = [value] if isinstance(value, str) or not isinstance(value, Iterable) else list(value)
    if isinstance(value, Mapping) or not all(isinstance(code, str | Number) and not isinstance(code, bool) for code in codes):
        raise UsageError(f"{name} = {shown(value)} must be a list of codes, such as [-9999].")
    return tuple(map(str, codes))


def _read_path(value: Any, name: str) -> Any:
    """Return a path, or what was read from one, which is nothing that Python itself has."""
    if isinstance(value, Number | bytes | list | tuple | dict | NoneType):
        refusal = f"{name} = {shown(value)} must be a path, such as 'my-cable', or data that bowdenfit has read."
        raise UsageError(refusal)
    return Path(value) if isinstance(value, str) else value


def _read_fit(value: Any, name: str) -> Any:
    if isinstance(value, str | PathLike):
        raise UsageError(f"{name} must be a fit; write bowdenfit.load({str(value)!r}) instead of the folder's name.")
    return _read_path(value, name)


def _read_fits(value: Any, name: str) -> dict[str, Any]:
    if not isinstance(value, Mapping):
        raise UsageError(f"{name} must be a dictionary of fits by name, such as {{'one': fit, 'another': other}}.")
    return {key: _read_fit(fit, f"{name}[{key!r}]") for key, fit in value.items()}


def as_pair(quantity: Quantity | None) -> NumberWithUnit | None:
    """Return a quantity that its `Reader` has read: no text any more, which type checkers cannot know."""
    assert not isinstance(quantity, str)
    return quantity


LENGTHS, TEXTS, CODES = (Reader(read, list[str]) for read in (_read_lengths, _read_texts, _read_codes))
PATH = Reader(_read_path, Path)  # a path, or what was read from it
FIT, FITS = Reader(_read_fit, Path), Reader(_read_fits, list[Path])  # of which the command line names the results folders
HIDDEN = Parameter(parse=False)  # for programs alone
DATASET = Parameter(
    "DATASET", help="Such as my-cable, a folder with a cable.toml, which `bowdenfit init my-cable` begins."
)
ANSWER = Parameter("--for", metavar="ANSWER", show_default="optimal-length; without a route the friction coefficient")
Purpose: TypeAlias = Annotated[Literal["design", "coefficients"], Parameter("--for", metavar="PURPOSE")]
"""What an answer is for: which length to cut, with its efficiency; or the coefficients."""
RESULTS = Parameter("RESULTS", help="Such as fits/my-cable, which `bowdenfit fit my-cable` writes.")
Output: TypeAlias = Annotated[str | Path | None, Parameter(alias="-o", metavar="FOLDER"), PATH]
Seed: TypeAlias = Annotated[int | None, Parameter(metavar="NUMBER"), whole_number(0, LARGEST_SEED)]
Bends: TypeAlias = Annotated[
    str | tuple[NumberWithUnit, NumberWithUnit] | None,
    Parameter(metavar="FROM:TO", show_default="all that were measured, such as 45deg:180deg"),
]


def read_quantity(text: str, option: str, example: str) -> NumberWithUnit:
    """Return a number with its unit, such as 180deg or "100 N".

    Args:
        text: As written.
        option: Name of the option.
        example: How it is written right.

    Raises:
        UsageError: It is something else.
    """
    match = _QUANTITY.fullmatch(text.strip())
    value, unit = (float(match["value"]), match["unit"]) if match else (0.0, "")
    if not unit or not math.isfinite(value):
        raise UsageError(f"{option} {shown(text)} is not a number with its unit; write it as {example}.")
    return value, unit


def read_lengths(texts: Sequence[str], name: str) -> list[float | NumberWithUnit]:
    """Return numbers, each with its unit where one stands behind it, as in 455 455mm 18 in.

    Args:
        texts: As written, a unit perhaps by itself.
        name: Name of the argument.

    Raises:
        UsageError: Something is no number.
    """
    lengths, text = list[float | NumberWithUnit](), " ".join(texts)
    while text := text.strip():
        match = _LENGTH.match(text)
        if match is None:
            raise UsageError(f"{name} {shown(text.split()[0])} is not a number; write lengths as 455, 455mm or 18 in.")
        value, unit = float(match["value"]), match["unit"]
        lengths.append((value, unit) if unit else value)
        text = text[match.end() :]
    return lengths
