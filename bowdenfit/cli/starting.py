"""Verbs that belong to the command line alone: a template to fill in, and completion of words by the shell."""

from importlib import resources
from pathlib import Path

import click

from bowdenfit.errors import UsageError

TEMPLATES = ("cable.toml", "angles.csv", "forces.csv")


@click.command(short_help="Write a template to fill in.")
@click.argument("folder", type=click.Path(path_type=Path))
def init(folder: Path) -> None:
    """Write a commented template to fill in: cable.toml, angles.csv and forces.csv."""
    there = [name for name in TEMPLATES if (folder / name).exists()]
    if there:
        raise UsageError(f"{folder / there[0]} exists already; name another folder, nothing was written.")
    folder.mkdir(parents=True, exist_ok=True)
    for name in TEMPLATES:
        text = resources.files("bowdenfit.templates").joinpath(name).read_text(encoding="utf-8")
        (folder / name).write_text(text, encoding="utf-8")
    click.echo(f"Wrote {', '.join(TEMPLATES)} to {folder}. Fill them in, then run: bowdenfit check {folder}")


@click.command(short_help="Print the shell completion script.")
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
@click.pass_context
def completion(context: click.Context, shell: str) -> None:
    """Print the completion script for SHELL; for bash: eval "$(bowdenfit completion bash)"."""
    from click.shell_completion import get_completion_class

    script = get_completion_class(shell)
    assert script is not None  # the three shells above have one
    click.echo(script(context.find_root().command, {}, "bowdenfit", "_BOWDENFIT_COMPLETE").source())
