"""What a kind of measurement declares of itself, as far as NumPy goes; its term in the likelihood is declared beside it."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Kind:
    """A kind of measurement.

    Args:
        name: What it is called under [tables] in cable.toml, and in fit.json.
        table: The class of its tables; no two kinds share one.
    """

    name: str
    table: type
