from . import identifiability_figure as identifiability_figure
from .answer import Identifiability as Identifiability
from .answer import rebuild_identifiability as rebuild_identifiability
from .judgment import assess_identifiability as assess_identifiability
from .sources import identify_source as identify_source
