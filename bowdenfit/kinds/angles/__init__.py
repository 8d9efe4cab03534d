"""Wrap angles of curved contacts along the route."""

from bowdenfit.kinds.angles.table import AngleTable, describe, implausible, page, read_angles, warnings_of
from bowdenfit.kinds.kind import Kind

ANGLES = Kind(
    name="angles",
    table=AngleTable,
    read=read_angles,
    describe=describe,
    warnings=warnings_of,
    implausible=implausible,
    page=page,
)
