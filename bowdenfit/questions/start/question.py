"""A question to a person: with a default, or with the reason why there is none."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar, runtime_checkable

from bowdenfit.errors import DatasetError, DescriptionError, Faults, UsageError, suggest_name
from bowdenfit.units import conversion_factor
from bowdenfit.words import shown

Answer = TypeVar("Answer")
_YES, _NO = ["yes", "y", "ja", "j", "oui", "o", "si", "s", "true", "1"], ["no", "n", "nein", "non", "false", "0"]
_QUANTITY = re.compile(r"(?P<value>[+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d+)?)\s*(?P<unit>\D.*)", re.ASCII)


@dataclass(frozen=True)
class Question(Generic[Answer]):
    """A question, how its answer is read, and its default.

    Args:
        words: The question.
        read: The answer in what was typed; refuses what is none with a sentence.
        default: What Enter alone says; None where nothing may be proposed.
        why: What the files do not say, and what would say it, in a sentence; with a default beside it, that is only proposed.
        example: An answer where there is no default, to show how it is written.
        options: What can be answered by a number, from 1, each in words.
    """

    words: str
    read: Callable[[str], Answer]
    default: str | None = None
    why: str = ""
    example: str = ""
    options: tuple[str, ...] = ()


@runtime_checkable
class Asker(Protocol):
    """Whoever answers questions: a person at a terminal, or `Unattended`."""

    def ask(self, question: Question[Answer]) -> Answer:
        """The answer."""
        ...

    def say(self, sentence: str) -> None:
        """What was understood without asking."""
        ...

    def settle(self) -> None:
        """Refuse here what was not answered, before later questions build on it."""
        ...


class Unattended:
    """Answer without a person: refuse together all that the files do not say; proposed defaults do not count as answers."""

    def __init__(self) -> None:
        self.faults = Faults()

    def ask(self, question: Question[Answer]) -> Answer:
        """Return the default; where it is only proposed, or missing, note the fault and go on with it or an example."""
        if question.default is None or question.why:
            self.faults.faults.append(DescriptionError(question.why))
        return question.read(question.example if question.default is None else question.default)

    def say(self, sentence: str) -> None:
        """Nothing."""

    def settle(self) -> None:
        """Refuse what is not said.

        Raises:
            DescriptionError: Something is not.
        """
        self.faults.refuse()


def text(words: str, default: str | None, why: str = "", example: str = "") -> Question[str]:
    """Ask for a line of text."""
    return Question(words, lambda typed: " ".join(typed.split()), default, why, example)


def yes_or_no(words: str, default: bool, why: str = "") -> Question[bool]:
    """Ask yes or no; `why` where the default is only proposed."""

    def read(typed: str) -> bool:
        answer = typed.strip().lower()
        if answer not in (*_YES, *_NO):
            raise UsageError(f"{shown(typed)} is neither yes nor no; write y or n.")
        return answer in _YES

    return Question(f"{words} (y or n)", read, "y" if default else "n", why)


def choose(
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
        raise UsageError(f"{shown(typed)} is none of them; write a number from 1 to {len(options)}.")

    return Question(
        words,
        read,
        None if default is None else str(default),
        why,
        "1",
        tuple(description for description, _ in options),
    )


def one_of(words: str, known: Sequence[str], default: str) -> Question[str]:
    """Ask for one of several known words."""

    def read(typed: str) -> str:
        if typed.strip() not in known:
            raise UsageError(f"{shown(typed)} is not known{suggest_name(typed.strip(), known)}")
        return typed.strip()

    return Question(words, read, default)


def unit(words: str, dimension: str, why: str, default: str | None = None) -> Question[str]:
    """Ask for a unit.

    Args:
        words: The question.
        dimension: What it measures.
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


def quantity(
    words: str, dimension: str, example: str, why: str = "", default: str | None = None
) -> Question[tuple[float, str]]:
    """Ask for a number with its unit.

    Args:
        words: The question.
        dimension: What it measures.
        example: How it is written.
        why: Why there is none that is more than proposed.
        default: What Enter takes.
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


def number(words: str, default: str | None, why: str = "", example: str = "") -> Question[float]:
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


def numbers(words: str, default: str, least: int = 0, exactly: int | None = None) -> Question[tuple[float, ...]]:
    """Ask for numbers separated by blanks, in rising order."""

    def read(typed: str) -> tuple[float, ...]:
        try:
            values = tuple(float(part.replace(",", ".")) for part in typed.replace(";", " ").split())
        except ValueError:
            raise UsageError(
                f"{shown(typed)} are not numbers; write them with blanks between, such as 430 530."
            ) from None
        if len(values) < least or (exactly is not None and len(values) != exactly):
            raise UsageError(
                f"{shown(typed)}: {exactly or least} numbers are needed, with blanks between, such as 430 530."
            )
        if not all(-1e9 < number < 1e9 for number in values) or list(values) != sorted(set(values)):
            raise UsageError(f"{shown(typed)} are not in rising order; write the smallest first, such as 430 530.")
        return values

    return Question(words, read, default)
