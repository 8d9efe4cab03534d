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
    """What is asked.

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
    """Who puts questions: a terminal, or nobody."""

    def ask(self, question: Question[Answer]) -> Answer:
        """The answer."""
        ...

    def say(self, sentence: str) -> None:
        """What was understood without asking."""
        ...

    def settle(self) -> None:
        """Before what rests on the answers so far."""
        ...


class Nobody:
    """Where there is no person: what files do not say is refused, all of it together, and proposals are no answers."""

    def __init__(self) -> None:
        self.faults = Faults()

    def ask(self, question: Question[Answer]) -> Answer:
        """The default; where it is only proposed, or an example, to find out what else is not said."""
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
    """A question after words of one line."""
    return Question(words, lambda typed: " ".join(typed.split()), default, why, example)


def agree(words: str, default: bool, why: str = "") -> Question[bool]:
    """A question after yes or no; `why` where the default is only proposed."""

    def read(typed: str) -> bool:
        said = typed.strip().lower()
        if said not in (*_YES, *_NO):
            raise UsageError(f"{shown(typed)} is neither yes nor no; write y or n.")
        return said in _YES

    return Question(f"{words} (y or n)", read, "y" if default else "n", why)


def choose(
    words: str, options: Sequence[tuple[str, Answer]], default: int | None = None, why: str = ""
) -> Question[Answer]:
    """A question after one of several, which are numbered from 1.

    Args:
        words: The question.
        options: Each in words, and what it stands for.
        default: Which of them Enter takes, from 1.
        why: Why there is no default, or none that is more than proposed.
    """

    def read(typed: str) -> Answer:
        said = typed.strip()
        if said.isascii() and said.isdecimal() and 1 <= int(said) <= len(options):
            return options[int(said) - 1][1]
        raise UsageError(f"{shown(typed)} is none of them; write a number from 1 to {len(options)}.")

    return Question(words, read, None if default is None else str(default), why, "1", tuple(each for each, _ in options))


def one_of(words: str, known: Sequence[str], default: str) -> Question[str]:
    """A question after one of several words."""

    def read(typed: str) -> str:
        if typed.strip() not in known:
            raise UsageError(f"{shown(typed)} is not known{suggest_name(typed.strip(), known)}")
        return typed.strip()

    return Question(words, read, default)


def unit(words: str, dimension: str, why: str, default: str | None = None) -> Question[str]:
    """A question after a unit.

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
    """A question after a number with its unit.

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
        value, written = float(match["value"].replace(",", ".")), match["unit"].strip()
        try:
            factor = conversion_factor(written, dimension)
        except DatasetError as error:
            raise UsageError(f"{error}.") from None
        if not 0 < value * factor < 1e9:
            raise UsageError(f"{shown(typed)} is not possible here; write a positive number with its unit, as {example}.")
        return value, written

    return Question(words, read, default, why, example)


def number(words: str, default: str | None, why: str = "", example: str = "") -> Question[float]:
    """A question after a positive number."""

    def read(typed: str) -> float:
        try:
            found = float(typed.strip().removesuffix("Hz").replace(",", "."))
        except ValueError:
            raise UsageError(f"{shown(typed)} is not a number; write one, such as {example or default}.") from None
        if not 0 < found < 1e9:
            raise UsageError(f"{shown(typed)} is not possible here; write a positive number, such as {example or default}.")
        return found

    return Question(words, read, default, why, example)


def numbers(words: str, default: str, least: int = 0, exactly: int | None = None) -> Question[tuple[float, ...]]:
    """A question after numbers with blanks between, in rising order."""

    def read(typed: str) -> tuple[float, ...]:
        try:
            found = tuple(float(part.replace(",", ".")) for part in typed.replace(";", " ").split())
        except ValueError:
            raise UsageError(f"{shown(typed)} are not numbers; write them with blanks between, such as 430 530.") from None
        if len(found) < least or (exactly is not None and len(found) != exactly):
            raise UsageError(f"{shown(typed)}: {exactly or least} numbers are needed, with blanks between, such as 430 530.")
        if not all(-1e9 < number < 1e9 for number in found) or list(found) != sorted(set(found)):
            raise UsageError(f"{shown(typed)} are not in rising order; write the smallest first, such as 430 530.")
        return found

    return Question(words, read, default)
