from . import teleoperation_figure as teleoperation_figure
from .answer import teleoperation_text as teleoperation_text
from .stability import assess_teleoperation as assess_teleoperation
