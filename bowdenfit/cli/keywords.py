"""The keywords of a function as options and arguments of the command line."""

import inspect
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, Unpack, get_args, get_origin, get_type_hints

import click

from bowdenfit.errors import UsageError
from bowdenfit.given import read_lengths, read_quantity
from bowdenfit.verb import Argument, Length, Option, Quantity, kinds_of
from bowdenfit.words import shown


@dataclass(frozen=True)
class Keyword:
    """One keyword of a verb's function.

    Args:
        name: Its name.
        kind: Its type.
        mark: How it is written on the command line.
        default: What counts if it is not.
        words: What the docstring says of it.
    """

    name: str
    kind: Any
    mark: Option | Argument
    default: Any
    words: str

    def parameter(self) -> click.Parameter:
        """The argument or option of click."""
        if isinstance(self.mark, Argument):
            many = -1 if self.mark.many else 1
            if self._is(Sequence[Length]):  # read later; of none, all are meant
                return click.Argument([self.name], nargs=many, metavar=f"[{self.mark.name}]...", required=False)
            metavar = self.mark.name + "..." * self.mark.many
            return click.Argument([self.name], type=_Named(self.mark), nargs=many, metavar=metavar, required=True)
        shown = self.default is not None and self.default != () and not self._is(bool)
        default = f"  [default: {self.mark.default}]" if self.mark.default else ""
        extra: dict[str, Any] = {"metavar": self.mark.metavar} if self.mark.metavar else {}
        if self._is(bool):
            extra["is_flag"] = True
        return click.Option(
            self._flags(self.mark),
            type=self._type(self.mark),
            default=None if self._is_many else self.default,
            multiple=self._is_many,
            required=self.mark.required,
            help=self.words + default,
            show_default=shown and not default,
            **extra,
        )

    def value(self, given: Any) -> Any:
        """What the function gets for what was written.

        Raises:
            UsageError: It cannot be read.
        """
        if given is None:
            return given
        if isinstance(self.mark, Argument):
            return read_lengths(given, self.mark.name) or None if self._is(Sequence[Length]) else given
        one = self._reader(self.mark)
        if one is None:
            return given
        if self._is(Mapping[str, float]):
            return dict(one(text) for text in given)
        return [one(text) for text in given] if self._is_many else one(given)

    def _reader(self, mark: Option) -> Callable[[str], Any] | None:
        """What reads one value; None where click has done so."""
        flag = self._flags(mark)[0]
        if self._is(Quantity) or self._is(Sequence[Quantity]):
            return lambda text: read_quantity(text, flag, mark.example)
        if self._is(Mapping[str, float]):
            return lambda text: read_named_number(text, flag, mark.example)
        return None

    def _is(self, *kinds: Any) -> bool:
        return any(kind in kinds_of(self.kind) for kind in kinds)

    @property
    def _is_many(self) -> bool:
        return self._is(Sequence[str], Sequence[Quantity], Mapping[str, float])

    def _flags(self, mark: Option) -> list[str]:
        """Flags, the long one first, and the name that the value goes by."""
        long = next((flag for flag in mark.flags if flag.startswith("--")), f"--{self.name.replace('_', '-')}")
        both = f"{long}/--no-{long[2:]}" if self._is(bool) and self.default else long
        return [both, *(flag for flag in mark.flags if flag != long), self.name]

    def _type(self, mark: Option) -> Any:
        for kind in kinds_of(self.kind):
            if get_origin(kind) is Literal:
                return click.Choice(get_args(kind))
            if kind is int:
                return click.IntRange(mark.least, mark.most)
        return bool if self._is(bool) else click.Path(path_type=Path) if self._is(Path) else str


class _Named(click.Path):
    """A path; where none is named, an example is."""

    def __init__(self, mark: Argument) -> None:
        super().__init__(path_type=Path)
        self.mark = mark

    def get_missing_message(self, param: click.Parameter, ctx: click.Context | None) -> str:  # noqa: ARG002
        """What click says behind the name of what is missing."""
        return f"Name {'some' if self.mark.many else 'one'}, such as {self.mark.such_as}."


def keywords_of(function: Callable[..., Any]) -> tuple[Keyword, ...]:
    """The keywords of a function that the command line has: arguments first, then what changes the reading of a data set.

    Args:
        function: Of a verb; its docstring says what each is for.
    """
    words, own, shared = _words(function), [], list[Keyword]()
    stated = inspect.signature(function).parameters
    for name, annotation in function.__annotations__.items():
        if get_origin(annotation) is Unpack:
            (record,) = get_args(annotation)
            hints, about = get_type_hints(record, include_extras=True), _words(record)
            shared = [_keyword(key, hint, stated[key].default, about) for key, hint in hints.items()]
        elif get_origin(annotation) is Annotated:
            default = None if stated[name].default is inspect.Parameter.empty else stated[name].default
            own.append(_keyword(name, annotation, default, words))
    arguments = [keyword for keyword in own if isinstance(keyword.mark, Argument)]
    return (*arguments, *shared, *(keyword for keyword in own if keyword not in arguments))


def _keyword(name: str, annotation: Any, default: Any, words: Mapping[str, str]) -> Keyword:
    return Keyword(name, annotation.__origin__, annotation.__metadata__[0], default, words.get(name, ""))


def _words(documented: Any) -> dict[str, str]:
    """What a docstring says of each argument."""
    _, _, text = inspect.cleandoc(documented.__doc__ or "").partition("Args:\n")
    words: dict[str, str] = {}
    name = ""
    for line in text.splitlines():
        if not line.startswith("    "):
            break
        if not line.startswith("     "):
            name, _, line = line.strip().partition(": ")
            words[name] = line
        else:
            words[name] += f" {line.strip()}"
    return words


def read_named_number(text: str, option: str, example: str) -> tuple[str, float]:
    """Kind and number of an option such as angle=0.5."""
    kind, _, number = text.partition("=")
    try:
        value = float(number)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise UsageError(f"{option} {shown(text)} is not a kind and a number; write it as {example}.")
    return kind.strip(), value
