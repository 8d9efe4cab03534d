"""The questions of `bowdenfit init` as a form: all that are known so far, with what was answered or is proposed."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

from bowdenfit.addons.app.page_words import page_words
from bowdenfit.errors import BowdenfitError
from bowdenfit.questions.start.question import Question

Answer = TypeVar("Answer")


class UnansweredError(Exception):
    """A question has no valid answer yet, and those behind it cannot be known."""


@dataclass(frozen=True)
class FormEntry:
    """One question of the form.

    Args:
        key: By which its answer is kept.
        words: The question.
        answer: Answer that was given, or is proposed; empty where nothing may be proposed.
        hint: An example, or why the files do not say it.
        options: Possible answers, as (answer, words); empty where it is typed.
        fault: Why the answer cannot be taken; empty where it can.
    """

    key: str
    words: str
    answer: str
    hint: str
    options: tuple[tuple[str, str], ...]
    fault: str


class Form:
    """Answers questions as the page has them, proposed answers included, up to the first that has none.

    Args:
        answers: Answers of the user, by key.
    """

    def __init__(self, answers: Mapping[str, str]) -> None:
        self.entries: list[FormEntry] = []
        self.sentences: list[str] = []
        self._answers, self._times = answers, Counter[str]()

    def ask(self, question: Question[Answer]) -> Answer:
        """Return the answer to a question.

        Raises:
            UnansweredError: It has none that is valid.
        """
        self._times[question.words] += 1
        key = f"{question.words} {self._times[question.words]}"
        typed = self._answers.get(key, question.default or "")
        if not typed.strip():
            self._note(key, question, typed, "")
            raise UnansweredError
        try:
            answer = question.read(typed)
        except BowdenfitError as error:
            self._note(key, question, typed, str(error))
            raise UnansweredError from None
        self._note(key, question, typed, "")
        return answer

    def say(self, sentence: str) -> None:
        """Keep what was understood without asking."""
        self.sentences.append(sentence)

    def report(self, sentence: str) -> None:
        """Keep what is left out."""
        self.sentences.append(sentence)

    def settle(self) -> None:
        """Do nothing: everything was answered."""

    def _note(self, key: str, question: Question[Any], typed: str, fault: str) -> None:
        """Add a question to the form."""
        options = tuple((str(i), option) for i, option in enumerate(question.options, start=1))
        if question.form == "yes or no":
            options = (("y", "yes"), ("n", "no"))
        hint = question.why or (f"such as {question.example}" if question.example and not options else "")
        if question.form == "word":
            options = tuple((option, option) for option in question.options)
        choices = () if question.form == "several" else options
        self.entries.append(FormEntry(key, page_words(question.words), typed, hint, choices, fault))
