"""Which parameters of stretch, preload and loop a data set needs."""

from bowdenfit.cable.elasticity import loop_mounting_parameter, preload_parameter, rope_parameters, stretch_parameters
from bowdenfit.description import Description, PriorDefaults
from bowdenfit.kinds.measurements import Measurements
from bowdenfit.parameters.space import Parameter


def elastic_parameters(
    description: Description, measurements: Measurements, defaults: PriorDefaults
) -> list[Parameter]:
    """The parameters of stretch, preload and loop that a data set needs."""
    parameters = []
    if _uses_rope(description, measurements):
        parameters += rope_parameters(defaults)
    if measurements.stretch is not None:
        parameters += stretch_parameters(description, defaults)
    if _uses_preload(description, measurements):
        parameters.append(preload_parameter(description, defaults.preload))
    if _mounting_matters(measurements):
        parameters.append(loop_mounting_parameter())
    return parameters


def _uses_rope(description: Description, measurements: Measurements) -> bool:
    """Whether anything measured depends on how the rope stretches."""
    return measurements.stretch is not None or (
        description.preload_follows_stretch and _uses_preload(description, measurements)
    )


def _uses_preload(description: Description, measurements: Measurements) -> bool:
    """Whether anything measured depends on the preload."""
    recorded = description.cable.kind == "loop" and measurements.recordings is not None
    return measurements.preload is not None or measurements.loop is not None or recorded


def _mounting_matters(measurements: Measurements) -> bool:
    """Whether a loop table's mounting scatters as other mountings do, which tell by how much."""
    told = (measurements.efficiencies, measurements.forces, measurements.recordings)
    return measurements.loop is not None and any(table is not None for table in told)
