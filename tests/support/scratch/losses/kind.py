"""Lost forces: their table, and how it is read and described."""

from dataclasses import dataclass

import numpy as np

from bowdenfit.files.columns import Quantity, require_column
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
    term_class = "scratch.losses.term:LossTerms"
    table = LossTable
    readings = (Readings("lost_force", "losses", "lost forces", "loss at {}", "Lost force (N)"),)

    def read(self, source):
        path = source.file
        table, columns = source.read_table(path, (Quantity("input_force", "force"), Quantity("loss", "force")))
        ends = [require_column(table, columns, name, f"{name}_N") for name in ("input_force", "loss")]
        force, loss = (np.array(column.numbers()) for column in ends)
        return TableFromFiles(LossTable(force, loss), {path.name: path}, accounts=(table.account,))

    def describe(self, table, description):
        return [f"losses: {self.count_readings(table)}"]

    def count_readings(self, table):
        return f"{len(table.loss)} lost forces"
