"""The verbs of this add-on."""

from bowdenfit.addons.device.compensate.verb import COMPENSATE
from bowdenfit.addons.device.teleoperate.verb import TELEOPERATE

__all__ = ["COMPENSATE", "TELEOPERATE"]
