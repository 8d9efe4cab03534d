"""What a verb is: one function, whose keywords are its options on the command line too.

A keyword becomes an option by `Annotated[type, Option(...)]`; its name, type and default, and what the function's docstring
says of it, are the option's. A keyword without belongs to programs alone. Loads nothing, so that `--help` is instant.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from inspect import Parameter, signature
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, ForwardRef, Literal, TypeAlias, TypeVar, Union, get_args, get_origin

Quantity: TypeAlias = tuple[float, str]  # a number and its unit
Length: TypeAlias = float | Quantity  # a number of the route's unit, or with its own
A_DATASET = "my-cable, a folder with a cable.toml, which `bowdenfit init my-cable` begins"
LARGEST_SEED = 2**31 - 1
NOT_TRUSTED = 3  # exit code
Function = TypeVar("Function", bound=Callable[..., Any])


@dataclass(frozen=True)
class Option:
    """How a keyword is written on the command line, as far as its name, type and docstring do not say.

    Args:
        flags: Other than the keyword's own name, such as "--set", or short ones beside it, such as "-o".
        example: Of what stands behind it, such as "180deg"; named where it cannot be read.
        metavar: What stands behind it in the help.
        default: In words, where the default of the keyword does not say it.
        least, most: Limits of a whole number.
        required: Whether it must be named on the command line.
    """

    flags: tuple[str, ...] = ()
    example: str = ""
    metavar: str | None = None
    default: str = ""
    least: int | None = None
    most: int | None = None
    required: bool = False


@dataclass(frozen=True)
class Argument:
    """How a positional argument is written on the command line.

    Args:
        name: In capitals in the help.
        many: Whether there may be several.
        results: Whether it is the results folder of a fit, of which the function takes the fit.
        such_as: An example, and where it comes from; said where nothing is named.
    """

    name: str
    many: bool = False
    results: bool = False
    such_as: str = "fits/my-cable, which `bowdenfit fit my-cable` writes"


@dataclass(frozen=True)
class Reply:
    """What the command line prints of an answer.

    Args:
        text: For people.
        page: Gives the answer for programs, asked only for `--json`.
        csv: Gives it as CSV, asked only for `--csv`.
        notes: Lines beside the answer, on standard error.
        exit_code: 0; 3 for an answer that must not be trusted, 2 for what is said of input that cannot be used.
    """

    text: str
    page: Callable[[], Any] | None = None
    notes: tuple[str, ...] = ()
    exit_code: int = 0
    csv: Callable[[], str] | None = None


@dataclass(frozen=True)
class Watch:
    """How a verb that takes long is watched and interrupted.

    Args:
        kept: File in the results folder that lets it go on later; empty where nothing does.
        remark: What is kept; the folder follows.
        bar: Options of the progress bar.
        show: Moves the bar by what the function reports.
    """

    kept: str
    remark: str
    bar: Mapping[str, Any]
    show: Callable[..., None]


@dataclass(frozen=True)
class Verb:
    """One verb of the command line and of notebooks.

    Args:
        function: What notebooks call.
        reply: What the command line prints, from the answer and the keywords it was asked with.
        short: In the list of verbs.
        text: In the verb's own help.
        name: On the command line; the function's if omitted.
        json: What `--json` prints, in words; empty without that option.
        csv: What `--csv` prints, in words; empty without that option.
        results: Folder in which results go unless `output` names another.
        watch: How it is interrupted; None if it is quick.
        warns: Whether a fit that is not to be trusted is said beside the answer, which then ends with `NOT_TRUSTED`.
        explains: A trouble of a fit that the answer is about, so that it is right in spite of it.
        kept: The reply by what a fit has answered before, and the keywords; None where they ask for something else. A
            reply without a page is for people only.
    """

    function: Callable[..., Any]
    reply: Callable[..., Reply]
    short: str
    text: str
    name: str = ""
    json: str = "Print as JSON."
    csv: str = ""
    results: str = ""
    watch: Watch | None = None
    warns: bool = False
    explains: str = ""
    kept: Callable[[Mapping[str, Any], Mapping[str, Any]], Reply | None] | None = None

    def __post_init__(self) -> None:
        with_named_keywords(self.function)


def kinds_of(kind: Any) -> tuple[Any, ...]:
    """What a value may be: the types of a union, or the only one."""
    return get_args(kind) if get_origin(kind) in {Union, UnionType} else (kind,)


def with_named_keywords(function: Function) -> Function:
    """A function whose signature is as its callers read it in help and in notebooks: no options, and every keyword by name."""
    stated = signature(function)
    parameters = [each for parameter in stated.parameters.values() for each in _as_called(parameter)]
    vars(function)["__signature__"] = stated.replace(parameters=parameters)
    return function


def _as_called(parameter: Parameter) -> Iterator[Parameter]:
    """A parameter with its plain type; of keywords in a record each by itself."""
    if parameter.kind is not Parameter.VAR_KEYWORD or not get_args(parameter.annotation):
        yield parameter.replace(annotation=_without_option(parameter.annotation))
        return
    (record,) = get_args(parameter.annotation)
    for name, annotation in record.__annotations__.items():
        default = () if "Sequence" in str(annotation) else None
        yield Parameter(name, Parameter.KEYWORD_ONLY, default=default, annotation=_without_option(annotation))


def _without_option(annotation: Any) -> Any:
    kind = get_args(annotation)[0] if get_origin(annotation) is Annotated else annotation
    return kind.__forward_arg__ if isinstance(kind, ForwardRef) else kind


Output: TypeAlias = str | Path | None
Stroke: TypeAlias = Literal["pull", "return"]
