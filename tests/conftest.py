"""Settings of every test: 64-bit floats, strict promotion of types, and shapes checked at run time."""

import sys
from pathlib import Path

import pytest
from jaxtyping import install_import_hook

with install_import_hook("bowdenfit", "beartype.beartype"):
    pass

import jax

from bowdenfit import cli

jax.config.update("jax_enable_x64", True)
jax.config.update("jax_numpy_dtype_promotion", "standard")

ROOT = Path(__file__).parent.parent


@pytest.fixture(scope="session")
def on_body() -> Path:
    """The data set of the on-body exoskeleton paper."""
    return ROOT / "datasets" / "on-body-exoskeleton"


@pytest.fixture(scope="session")
def bench() -> Path:
    """The plan of the synthetic bench."""
    return ROOT / "datasets" / "synthetic-bench" / "bench.toml"


@pytest.fixture
def run(monkeypatch, capsys):
    """Run the command line in this process: exit code, standard output, standard error."""

    def call(*arguments):
        monkeypatch.setattr(sys, "argv", ["bowdenfit", *map(str, arguments)])
        with pytest.raises(SystemExit) as stop:
            cli.main()
        printed = capsys.readouterr()
        return stop.value.code, printed.out, printed.err

    return call
