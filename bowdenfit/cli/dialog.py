"""Questions in a terminal: a wrong answer is asked again with a sentence, and Ctrl-C or Ctrl-D ends without a trace."""

import sys
from typing import TypeVar

from bowdenfit.cli.terminal import say
from bowdenfit.errors import BowdenfitError
from bowdenfit.questions.start.question import Question
from bowdenfit.words import filled

Answer = TypeVar("Answer")


class Terminal:
    """A person at a terminal."""

    def ask(self, question: Question[Answer]) -> Answer:
        """The answer to a question, asked until there is one."""
        say("")
        say(filled(question.words))
        for i, option in enumerate(question.options, start=1):
            say(filled(f"{i}  {option}", "  "))
        if question.default is None:
            such = "" if question.options else f"such as {question.example}; "
            say(f"({such}there is no default, because nothing says it)")
        shown = f"[{question.default}]" if question.default is not None else ""
        while True:
            typed = _read_line(f"{shown}> ") or question.default or ""
            if not typed.strip():
                say("Something must be written here; Ctrl-C ends it all, and nothing is written.")
                continue
            try:
                return question.read(typed)
            except BowdenfitError as error:
                say(filled(f"{str(error)[:1].upper()}{str(error)[1:]}"))

    def say(self, sentence: str) -> None:
        """What was understood without asking."""
        say(filled(sentence))

    def settle(self) -> None:
        """Nothing: everything was answered."""


def _read_line(prompt: str) -> str:
    """What is typed behind a prompt."""
    say(prompt, nl=False)
    sys.stdout.flush()
    line = sys.stdin.readline()
    if not line:
        say("")
        raise KeyboardInterrupt
    return line.rstrip("\n")


def is_interactive() -> bool:
    """Whether somebody can be asked."""
    return sys.stdin is not None and sys.stdin.isatty() and sys.stdout.isatty()
