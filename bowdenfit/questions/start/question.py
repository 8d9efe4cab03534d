"""Questions to a person: the question, its default or the reason why there is none, and how an answer is read.

Names are refused at once where `check` would refuse them later, in the same words.
"""

import re
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Generic, Literal, Protocol, TypeVar, runtime_checkable

from pydantic import TypeAdapter, ValidationError

from bowdenfit.description import RESERVED_NAMES, ContactSettings, Name
from bowdenfit.description.file import PLACEHOLDERS
from bowdenfit.errors import DatasetError, DescriptionError, Faults, UsageError, suggest_name
from bowdenfit.units import conversion_factor
from bowdenfit.words import shown

Answer = TypeVar("Answer")
_YES, _NO = ["yes", "y", "ja", "j", "oui", "o", "si", "s", "true", "1"], ["no", "n", "nein", "non", "false", "0"]
_QUANTITY = re.compile(r"(?P<value>[+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d+)?)\s*(?P<unit>\D.*)", re.ASCII)
PARAMETER_NAMES = {
    "bedding_load", "bedding_stretch", "delay_error", "drag", "end_spring", "gain_error", "input_offset", "lengthening",
    "load_exponent", "loop_mounting", "mu_stretch", "output_offset", "preload", "ring_friction", "ring_inertia",
    "ring_stiffness", "rope_damping", "rope_give", "rope_stiffness", "sigma_F", "sigma_L", "sigma_P", "sigma_block",
    "sigma_ringdown", "sigma_theta", "sigma_x", "stiffness", "stretch_zero", "stribeck", "stribeck_speed", "stroke_difference",
    "tau", "viscous",
}  # fmt: skip
"""Names of all parameters that belong neither to a contact, a column nor a run: coefficients may not use them."""
_RUN_PARAMETER = re.compile(r"(amplitude|displacement_zero|release|rest)_\d+")
_CURVE_PARAMETERS = ("a", "b", "c", "A", "B", "C", "middle", "slope", "mean")  # endings, behind the name of the column
_NAME = TypeAdapter[str](Name)


@dataclass(frozen=True)
class Question(Generic[Answer]):
    """A question to a person, with its default.

    Args:
        words: The question.
        read: Return the answer that was typed; refuses what is none with a sentence.
        default: Answer that Enter gives; None where nothing may be proposed.
        why: What the files do not say, and what would say it, in a sentence; with a default beside it, that is only proposed.
        example: An answer where there is no default, to show how it is written.
        options: Answers that may be given by a number, from 1, each in words; of a word the words themselves.
        form: How it is answered: by a text, by one of the options, by the numbers of several, by yes or no, or by a word.
    """

    words: str
    read: Callable[[str], Answer]
    default: str | None = None
    why: str = ""
    example: str = ""
    options: tuple[str, ...] = ()
    form: Literal["text", "choice", "several", "yes or no", "word"] = "text"


@runtime_checkable
class Asker(Protocol):
    """Whoever answers questions: a person at a terminal, or `Unattended`."""

    def ask(self, question: Question[Answer]) -> Answer:
        """Return the answer to a question."""
        ...

    def say(self, sentence: str) -> None:
        """Say what was understood without asking."""
        ...

    def report(self, sentence: str) -> None:
        """Report what is left out, whoever is there."""
        ...

    def settle(self) -> None:
        """Refuse here what was not answered, before later questions build on it."""
        ...


class Unattended:
    """Answer without a person: refuse together all that the files do not say; proposed defaults do not count as answers."""

    def __init__(self) -> None:
        self.faults, self.left_out = Faults(), list[str]()

    def ask(self, question: Question[Answer]) -> Answer:
        """Return the default; where it is only proposed, or missing, note the fault and go on with it or an example."""
        if question.default is None or question.why:
            self.faults.faults.append(DescriptionError(question.why))
        return question.read(question.example if question.default is None else question.default)

    def say(self, sentence: str) -> None:
        """Say nothing."""

    def report(self, sentence: str) -> None:
        """Keep what is left out, to be printed behind what was written."""
        self.left_out.append(sentence)

    def settle(self) -> None:
        """Refuse what is not said.

        Raises:
            DescriptionError: Something is not.
        """
        self.faults.refuse()


def text_question(words: str, default: str | None, why: str = "", example: str = "") -> Question[str]:
    """Ask for a line of text."""
    return Question(words, lambda typed: " ".join(typed.split()), default, why, example)


def yes_no_question(words: str, default: bool, why: str = "") -> Question[bool]:
    """Ask yes or no; `why` where the default is only proposed."""

    def read(typed: str) -> bool:
        answer = typed.strip().lower()
        if answer not in (*_YES, *_NO):
            raise UsageError(f"{shown(typed)} is neither yes nor no; write y or n.")
        return answer in _YES

    return Question(words, read, "y" if default else "n", why, form="yes or no")


def choice_question(
    words: str, options: Sequence[tuple[str, Answer]], default: int | None = None, why: str = ""
) -> Question[Answer]:
    """Ask for one of several options, numbered from 1.

    Args:
        words: The question.
        options: Each in words, and what it stands for.
        default: Which of them Enter takes, from 1.
        why: Why there is no default, or none that is more than proposed.
    """

    def read(typed: str) -> Answer:
        answer = typed.strip()
        if answer.isascii() and answer.isdecimal() and 1 <= int(answer) <= len(options):
            return options[int(answer) - 1][1]
        raise UsageError(f"{shown(typed)} is not one of them; write a number from 1 to {len(options)}.")

    return Question(
        words,
        read,
        None if default is None else str(default),
        why,
        "1",
        tuple(description for description, _ in options),
        "choice",
    )


def word_question(words: str, known: Sequence[str], default: str) -> Question[str]:
    """Ask for one of several known words."""

    def read(typed: str) -> str:
        if typed.strip() not in known:
            raise UsageError(f"{shown(typed)} is not known{suggest_name(typed.strip(), known)}")
        return typed.strip()

    return Question(words, read, default, options=tuple(known), form="word")


def unit_question(words: str, dimension: str, why: str, default: str | None = None) -> Question[str]:
    """Ask for a unit.

    Args:
        words: The question.
        dimension: Dimension of the number.
        why: Why there is none that is more than proposed.
        default: The unit that Enter takes.
    """

    def read(typed: str) -> str:
        try:
            conversion_factor(typed.strip(), dimension)
        except DatasetError as error:
            raise UsageError(f"{error}.") from None
        return typed.strip()

    usual = {"force": "N", "angle": "deg", "length": "mm", "ratio": "%", "time": "s", "torque": "N*m"}
    return Question(words, read, default, why, usual.get(dimension, "mm"))


def quantity_question(
    words: str, dimension: str, example: str, why: str = "", default: str | None = None
) -> Question[tuple[float, str]]:
    """Ask for a number with its unit.

    Args:
        words: The question.
        dimension: Dimension of the numbers.
        example: How it is written.
        why: Why there is none that is more than proposed.
        default: Answer that Enter gives.
    """

    def read(typed: str) -> tuple[float, str]:
        match = _QUANTITY.fullmatch(typed.strip())
        if not match:
            raise UsageError(f"{shown(typed)} is not a number with its unit; write it as {example}.")
        value, unit_name = float(match["value"].replace(",", ".")), match["unit"].strip()
        try:
            factor = conversion_factor(unit_name, dimension)
        except DatasetError as error:
            raise UsageError(f"{error}.") from None
        if not 0 < value * factor < 1e9:
            raise UsageError(
                f"{shown(typed)} is not possible here; write a positive number with its unit, as {example}."
            )
        return value, unit_name

    return Question(words, read, default, why, example)


def number_question(words: str, default: str | None, why: str = "", example: str = "") -> Question[float]:
    """Ask for a positive number."""

    def read(typed: str) -> float:
        try:
            value = float(typed.strip().removesuffix("Hz").replace(",", "."))
        except ValueError:
            raise UsageError(f"{shown(typed)} is not a number; write one, such as {example or default}.") from None
        if not 0 < value < 1e9:
            raise UsageError(
                f"{shown(typed)} is not possible here; write a positive number, such as {example or default}."
            )
        return value

    return Question(words, read, default, why, example)


def numbers_question(
    words: str, default: str, least: int = 0, exactly: int | None = None
) -> Question[tuple[float, ...]]:
    """Ask for numbers separated by blanks, in rising order."""

    def read(typed: str) -> tuple[float, ...]:
        try:
            values = tuple(float(part.replace(",", ".")) for part in typed.replace(";", " ").split())
        except ValueError:
            raise UsageError(
                f"{shown(typed)} are not numbers; separate them by spaces, such as 430 530."
            ) from None
        if len(values) < least or (exactly is not None and len(values) != exactly):
            raise UsageError(
                f"{shown(typed)}: {exactly or least} numbers are needed, separated by spaces, such as 430 530."
            )
        if not all(-1e9 < number < 1e9 for number in values) or list(values) != sorted(set(values)):
            raise UsageError(f"{shown(typed)} are not in rising order; write the smallest first, such as 430 530.")
        return values

    return Question(words, read, default)


def cable_name_question(words: str, default: str | None, why: str = "", example: str = "") -> Question[str]:
    """Ask for the name of a cable."""
    return Question(words, _read_name, default, why, example)


def contact_name_question(words: str, default: str | None, taken: Collection[str]) -> Question[str]:
    """Ask for the name of a contact.

    Args:
        words: The question.
        default: Answer that Enter gives; not proposed where another contact is called so.
        taken: The names of the other contacts.
    """

    def read(typed: str) -> str:
        name = _read_name(typed)
        if name in taken:
            raise UsageError(f"{shown(name)} is another place already; write another one.")
        return name

    proposed = None if default in taken else default
    reason = "two places would have the same name." if default else "a place where the rope rubs needs a name."
    return Question(words, read, proposed, "" if proposed else reason, "edge")


def coefficient_name_question(words: str, default: str, columns: Collection[str]) -> Question[str]:
    """Ask for the name of a coefficient of friction.

    Args:
        words: The question.
        default: Answer that Enter gives.
        columns: Columns of wrap angles, after which the parameters of their curves are called.
    """

    def read(typed: str) -> str:
        name = _read_name(typed)
        _refuse_invalid(lambda: ContactSettings.model_validate({"name": "x", "friction": name, "wrap_angle": {"column": "x"}}))
        of_curves = {f"{column}_{ending}" for column in columns for ending in _CURVE_PARAMETERS}
        if name in PARAMETER_NAMES or name in RESERVED_NAMES or name in of_curves or _RUN_PARAMETER.fullmatch(name):
            raise UsageError(
                f"{shown(name)} is what results call another number; write another name, such as {default}."
            )
        return name

    return Question(words, read, default)


def _read_name(typed: str) -> str:
    """Return a name as typed, without needless blanks; refuse placeholders and invalid names."""
    name = " ".join(typed.split())
    if name in PLACEHOLDERS:
        raise UsageError(f"{shown(name)} is left from the template; write {PLACEHOLDERS[name]}.")
    _refuse_invalid(lambda: _NAME.validate_python(name))
    return name


def _refuse_invalid(validate: Callable[[], object]) -> None:
    """Refuse what a description would refuse."""
    try:
        validate()
    except ValidationError as error:
        raise UsageError(f"{error.errors()[0]['msg'].removeprefix('Value error, ')}.") from None
