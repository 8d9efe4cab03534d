from . import teleoperation_figure as teleoperation_figure
from .measured import read_measured_contact as read_measured_contact
from .stability import assess_teleoperation as assess_teleoperation
