"""What functions take from their callers: texts with units, lists, folders and fits, read where they come in.

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
from inspect import signature, unwrap
from numbers import Integral, Number, Real
from os import PathLike
from pathlib import Path
from types import NoneType
from typing import Annotated, Any, ForwardRef, Literal, TypeAlias, TypeVar, cast, get_args, get_origin, get_type_hints

from cyclopts import Parameter

from bowdenfit.errors import UsageError, nearest
from bowdenfit.words import shown

NumberWithUnit: TypeAlias = tuple[float, str]
Quantity: TypeAlias = str | NumberWithUnit  # as callers write it: "50N", or (50, "N")
Length: TypeAlias = float | Quantity  # a number without a unit is one of the route's
Stroke: TypeAlias = Literal["pull", "return"]
LARGEST_SEED = 2**31 - 1
_NUMBER = r"(?P<value>[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)"
_FLOAT, _WHOLE = re.compile(_NUMBER), re.compile(r"[+-]?[0-9]{1,18}")
_LENGTH = re.compile(_NUMBER + r"\s*(?P<unit>[^\W\d][^\s]*)?(?=\s|$)")
_QUANTITY = re.compile(_NUMBER + r"\s*(?P<unit>(?!\.|[eE]\d)\D.*)", re.ASCII)
Function = TypeVar("Function", bound=Callable[..., Any])


@dataclass(frozen=True)
class Reader:
    """How an argument is read whose type alone does not say it.

    Args:
        read: Returns the argument as the function takes it, from what was written and the name to call it by in a refusal.
        written: Type of what stands on the command line, which `read` takes too.
    """

    read: Callable[[Any, str], Any]
    written: Any = str


@dataclass(frozen=True)
class Declared:
    """What a function declares of a parameter.

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
        """The type; nothing is known of one that takes long to load."""
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
    return {name: _declared(each) for name, each in parameters.items()}


def _declared(parameter: Stated) -> Declared:
    is_annotated = get_origin(parameter.annotation) is Annotated
    type_, *marks = get_args(parameter.annotation) if is_annotated else (parameter.annotation,)
    type_ = type_.__forward_arg__ if isinstance(type_, ForwardRef) else type_
    reader = next((mark for mark in marks if isinstance(mark, Reader)), None)
    default = () if reader is TEXTS else parameter.default
    option = Parameter.combine(*(mark for mark in marks if isinstance(mark, Parameter)))
    return Declared(parameter.replace(annotation=type_, default=default), reader, option)


def checked(function: Function) -> Function:
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
    return cast("Function", call)


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
            raise UsageError(f"there is no keyword {name!r}{nearest(name, list(parameters))}")
        declared = parameters[name]
        if value is not declared.plain.default:
            called = declared.written_name if typed else name
            values[name] = declared.reader.read(value, called) if declared.reader else _validated(declared.type, value, called)
    return values


def _validated(type_: Any, value: Any, name: str) -> Any:
    """A value of a type, as pydantic has it."""
    from pydantic import ConfigDict, TypeAdapter, ValidationError

    try:
        return TypeAdapter(type_, config=ConfigDict(arbitrary_types_allowed=True)).validate_python(value)
    except ValidationError as error:
        (fault, *_) = error.errors()
        if fault["type"] == "literal_error":
            choices = fault["ctx"]["expected"].replace("'", "").replace(" or ", ", ")
            raise UsageError(f"{name} = {shown(value)} is unknown; choose one of {choices}.") from None
        raise UsageError(f"{name} = {shown(value)} cannot be used: {fault['msg'][:1].lower()}{fault['msg'][1:]}.") from None


def number_with_unit(example: str) -> Reader:
    """Return what reads a number with its unit, such as the example."""

    def read(written: Any, name: str) -> NumberWithUnit:
        if isinstance(written, str):
            return read_quantity(written, name, example)
        if _is_number_with_unit(written) and math.isfinite(written[0]):
            return float(written[0]), written[1]
        value, unit = read_quantity(example, name, example)
        example_pair = f"({value:g}, {unit!r})"
        raise UsageError(
            f"{name} = {shown(written)} is not a number with its unit; write it as {example!r}, or as {example_pair}."
        )

    return Reader(read)


def numbers_with_units(example: str) -> Reader:
    """Return what reads numbers with their units, or one by itself, such as the example."""
    read = number_with_unit(example).read
    return Reader(lambda written, name: [read(each, name) for each in _several(written)], list[str])


def numbers_by_name(example: str) -> Reader:
    """Return what reads numbers by names, which the command line writes as the example."""

    def read(text: str, name: str) -> tuple[str, float]:
        key, _, number = text.partition("=")
        if not _FLOAT.fullmatch(number.strip()):
            raise UsageError(f"{name} {shown(text)} is not a kind and a number; write it as {example}.")
        return key.strip(), float(number)

    return Reader(
        lambda written, name: dict(
            written if isinstance(written, Mapping) else [read(each, name) for each in _read_texts(written, name)]
        ),
        list[str],
    )


def whole_number(least: int, most: float = math.inf) -> Reader:
    """Return what reads a whole number between limits."""

    def read(written: Any, name: str) -> int:
        is_whole = isinstance(written, Integral) and not isinstance(written, bool)
        is_text = isinstance(written, str) and _WHOLE.fullmatch(written)
        if (is_whole or is_text) and least <= int(written) <= most:
            return int(written)
        limits = f" from {least}" + (f" to {most}" if most < math.inf else "")
        raise UsageError(f"{name} = {shown(written)} is no whole number{limits}; write one.")

    return Reader(read)


def _several(written: Any) -> list[Any]:
    """What was written, one by one; a text and a number with its unit are one."""
    is_one = isinstance(written, str) or _is_number_with_unit(written) or not isinstance(written, Iterable)
    return [written] if is_one else list(written)


def _is_number_with_unit(written: Any) -> bool:
    is_pair = isinstance(written, tuple | list) and len(written) == 2
    return is_pair and isinstance(written[0], Real) and isinstance(written[1], str)


def _read_lengths(written: Any, name: str) -> list[float | NumberWithUnit]:
    lengths = _several(written)
    if not lengths:
        raise UsageError(f"{name} = {shown(written)} names no length; name some, or leave it out where all are meant.")
    if not all(isinstance(each, str | Real) or _is_number_with_unit(each) for each in lengths):
        raise UsageError(f"{name} = {shown(written)} are no lengths; write them as [455, 470], or ['18 in'].")
    if all(isinstance(each, str) for each in lengths):  # of which a unit may be one by itself
        return read_lengths(lengths, name)
    return [one for each in lengths for one in (read_lengths([each], name) if isinstance(each, str) else [_length(each)])]


def _length(written: Any) -> float | NumberWithUnit:
    return float(written) if isinstance(written, Real) else (float(written[0]), written[1])


def _read_texts(written: Any, name: str) -> Sequence[str]:
    texts = tuple(_several(written))
    if isinstance(written, Mapping) or not all(isinstance(text, str) for text in texts):
        raise UsageError(f"{name} = {shown(written)} is no list of texts; write it as ['name=value'].")
    return texts


def _read_place(written: Any, name: str) -> Any:
    """Return a path, or what was read from one, which is nothing that Python itself has."""
    if isinstance(written, Number | bytes | list | tuple | dict | NoneType):
        refusal = f"{name} = {shown(written)} is neither a path nor what bowdenfit has read; write it as 'my-cable'."
        raise UsageError(refusal)
    return Path(written) if isinstance(written, str) else written


def _read_fit(written: Any, name: str) -> Any:
    if isinstance(written, str | PathLike):
        raise UsageError(f"{name} is the fit itself; write bowdenfit.load({str(written)!r}) instead of the folder's name.")
    return _read_place(written, name)


def _read_fits(written: Any, name: str) -> dict[str, Any]:
    if not isinstance(written, Mapping):
        raise UsageError(f"{name} are the fits by names of yours; write them as {{'one': fit, 'another': other}}.")
    return {key: _read_fit(fit, f"{name}[{key!r}]") for key, fit in written.items()}


def measured(quantity: Quantity | None) -> NumberWithUnit | None:
    """Return a quantity that `checked` has read, which is no text any more, as type checkers cannot know."""
    assert not isinstance(quantity, str)
    return quantity


LENGTHS, TEXTS = Reader(_read_lengths, list[str]), Reader(_read_texts, list[str])
PLACE = Reader(_read_place, Path)  # a path, or what was read from it
FIT, FITS = Reader(_read_fit, Path), Reader(_read_fits, list[Path])  # of which the command line names the results folders
HIDDEN = Parameter(parse=False)  # for programs alone
DATASET = Parameter(
    "DATASET", help="Such as my-cable, a folder with a cable.toml, which `bowdenfit init my-cable` begins."
)
RESULTS = Parameter("RESULTS", help="Such as fits/my-cable, which `bowdenfit fit my-cable` writes.")
Output: TypeAlias = Annotated[str | Path | None, Parameter(alias="-o", metavar="FOLDER"), PLACE]
Seed: TypeAlias = Annotated[int | None, Parameter(metavar="NUMBER"), whole_number(0, LARGEST_SEED)]
Bends: TypeAlias = Annotated[
    str | tuple[NumberWithUnit, NumberWithUnit] | None,
    Parameter(metavar="FROM:TO", show_default="all that were measured, such as 45deg:180deg"),
]


def read_quantity(text: str, option: str, example: str) -> NumberWithUnit:
    """Return a number with its unit, such as 180deg or "100 N".

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


def read_lengths(texts: Sequence[str], name: str) -> list[float | NumberWithUnit]:
    """Return numbers, each with its unit where one stands behind it, as in 455 455mm 18 in.

    Args:
        texts: As written, a unit perhaps by itself.
        name: Of the argument.

    Raises:
        UsageError: Something is no number.
    """
    lengths, text = list[float | NumberWithUnit](), " ".join(texts)
    while text := text.strip():
        match = _LENGTH.match(text)
        if match is None:
            raise UsageError(f"{name} {shown(text.split()[0])} is no number; write lengths as 455, 455mm or 18 in.")
        value, unit = float(match["value"]), match["unit"]
        lengths.append((value, unit) if unit else value)
        text = text[match.end() :]
    return lengths
