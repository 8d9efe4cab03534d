"""A kind of table: the force lost while pulling, at an input force."""

from bowdenfit.kinds.kind import Kind
from bowdenfit.kinds.readings import Readings
from scratch.losses.table import LossTable, count, describe, read

LOSSES = Kind(
    name="losses",
    table=LossTable,
    readings=(Readings("lost_force", "losses", "lost forces", "loss at {}", "Lost force (N)"),),
    read=read,
    describe=describe,
    count=count,
)
