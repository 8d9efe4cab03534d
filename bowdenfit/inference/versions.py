"""Versions of what computes: of a fit, and of the client and the workers of a cluster, which must be the same."""

import platform
import re
from functools import cache

from bowdenfit.errors import UsageError
from bowdenfit.words import listed

VERSIONED = ("bowdenfit", "jax", "optimistix", "emcee", "blackjax", "arviz-stats", "numpy", "scipy")


@cache
def versions() -> dict[str, str]:
    """Of bowdenfit, Python and the libraries that computed."""
    from importlib.metadata import PackageNotFoundError, distribution

    def version_of(package: str) -> str:
        try:
            installed = distribution(package)
        except PackageNotFoundError:
            return "(not installed)"
        stated = re.search(r"^Version: (.+)$", installed.read_text("METADATA") or "", re.MULTILINE)  # parsing all takes longer
        return stated[1] if stated else installed.version

    return {package: version_of(package) for package in VERSIONED} | {"python": platform.python_version()}


def refuse_other_versions(of_client: dict[str, str]) -> None:
    """Refuse work of a program that is not the same as here, whose draws could be others.

    Args:
        of_client: Versions where the work comes from.

    Raises:
        UsageError: Some differ.
    """
    here = versions()
    differing = [
        f"{name} {here.get(name, '(not installed)')} (here {version})"
        for name, version in of_client.items()
        if here.get(name) != version
    ]
    if differing:
        raise UsageError(
            f"a worker has other versions: {listed(differing)}. Draws must not depend on who makes them: install the same "
            "versions on all workers as here, such as from constraints.txt."
        )
