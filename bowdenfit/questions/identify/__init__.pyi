from . import identifiability_figure as identifiability_figure
from .answer import Identifiability as Identifiability
from .answer import rebuild_identifiability as rebuild_identifiability
from .judgment import assess_identifiability as assess_identifiability
from .likelihood import contour_parameters as contour_parameters
from .likelihood import profile_parameter as profile_parameter
from .sources import identify_source as identify_source
