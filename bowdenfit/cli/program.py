"""The program: every verb as a command."""

from typing import Annotated, Literal

from cyclopts import App, Parameter

from bowdenfit.cli.commands import LOOK, command
from bowdenfit.cli.starting import HELP, init
from bowdenfit.cli.terminal import say
from bowdenfit.verbs import VERBS

_HELP = """Friction coefficients of a Bowden cable from bench measurements.

With honest uncertainty, and the cable length that transmits force best.

Start with `bowdenfit init FOLDER`, fill in the files, `bowdenfit check FOLDER`,
then `bowdenfit fit FOLDER`.

Exit codes: 0 done (a fit has converged); 1 failure; 2 bad usage or bad input;
3 the fit finished but must not be trusted; 130 interrupted, with the checkpoint
kept.
"""
_COMPLETION = """Print the completion script of a shell.

For bash: eval "$(bowdenfit completion bash)"
"""


def _completion(shell: Annotated[Literal["bash", "zsh", "fish"], Parameter("SHELL", help="Such as bash.")], /) -> None:
    say(bowdenfit.generate_completion(shell=shell))


def _version() -> str:
    from importlib.metadata import version

    return f"bowdenfit, version {version('bowdenfit')}"


bowdenfit = App(name="bowdenfit", help=_HELP, version=_version, **LOOK)
COMMANDS = (
    App(name="init", help=HELP, default_command=init, **LOOK),
    *map(command, VERBS),
    App(name="completion", help=_COMPLETION, default_command=_completion, **LOOK),
)
for position, verb in enumerate(COMMANDS):
    verb.sort_key = position
    bowdenfit.command(verb)
