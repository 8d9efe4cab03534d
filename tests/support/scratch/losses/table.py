"""Lost forces as rows."""

from dataclasses import dataclass

import numpy as np

from bowdenfit.files.columns import Quantity, find_columns, require
from bowdenfit.files.csv_table import read_csv
from bowdenfit.kinds.kind import Found
from bowdenfit.types import Vector


@dataclass(frozen=True)
class LossTable:
    """Input forces and what is lost of them [N]."""

    input_force: Vector
    loss: Vector


def read(source):
    """Read the table."""
    path = source.file
    table = read_csv(path)
    found = find_columns(table, (Quantity("input_force", "force"), Quantity("loss", "force")), source.settings.columns)
    force, loss = (require(table, found, name, f"{name}_N").numbers() for name in ("input_force", "loss"))
    return Found(LossTable(np.array(force), np.array(loss)), {path.name: path}, accounts=(table.account,))


def describe(table, description):
    """What was understood."""
    return [f"losses: {count(table)}"]


def count(table):
    """How many."""
    return f"{len(table.loss)} lost forces"
