"""Wrap angles of curved contacts along the route."""

from bowdenfit.kinds.angles.table import (
    AngleDesign,
    AngleSettings,
    AngleTable,
    contradiction,
    describe,
    empty,
    implausible,
    page,
    read_angles,
    warnings_of,
)
from bowdenfit.kinds.asked import Asked
from bowdenfit.kinds.copies import copies, without_runs
from bowdenfit.kinds.kind import Kind
from bowdenfit.kinds.readings import Readings

ANGLES = Kind(
    name="angles",
    table=AngleTable,
    readings=(Readings("wrap_angle", "angles", "wrap angles", "{}", "Wrap angle (deg)", "deg"),),
    read=read_angles,
    settings=AngleSettings,
    contradiction=contradiction,
    quantities=lambda said, _: [("tables, angles, detection_limit", said.detection_limit, "angle")],
    describe=describe,
    warnings=warnings_of,
    copies=lambda table: copies(without_runs(table.origin, table.route, table.angle, table.route)),
    method="Wrap angles along the route followed curves, which were fitted with everything else.",
    implausible=implausible,
    page=page,
    design=AngleDesign,
    empty=empty,
    asked=Asked("wrap angles at several lengths of the cable", by_length=True),
)
