from . import teleoperation_figure as teleoperation_figure
from .stability import assess_teleoperation as assess_teleoperation
