"""Lost forces: their table, and how it is read and described."""

from dataclasses import dataclass

import numpy as np

from bowdenfit.files.columns import Quantity, find_columns, require_column
from bowdenfit.files.tables import read_csv
from bowdenfit.kinds.kind import Kind, Readings
from bowdenfit.kinds.table_files import TableFromFiles
from bowdenfit.types import Vector


@dataclass(frozen=True)
class LossTable:
    """Input forces and what is lost of them [N]."""

    input_force: Vector
    loss: Vector


class LossKind(Kind[LossTable]):
    """The five things that a kind must give, and a count for the summary."""

    name = "losses"
    table = LossTable
    readings = (Readings("lost_force", "losses", "lost forces", "loss at {}", "Lost force (N)"),)

    def read(self, source):
        path = source.file
        table = read_csv(path)
        found = find_columns(table, (Quantity("input_force", "force"), Quantity("loss", "force")), source.columns)
        force, loss = (np.array(require_column(table, found, name, f"{name}_N").numbers()) for name in ("input_force", "loss"))
        return TableFromFiles(LossTable(force, loss), {path.name: path}, accounts=(table.account,))

    def describe(self, table, description):
        return [f"losses: {self.count_readings(table)}"]

    def count_readings(self, table):
        return f"{len(table.loss)} lost forces"
