from .writers import CALLBACK_ENDING as CALLBACK_ENDING
from .writers import ENDINGS as ENDINGS
from .writers import NAMES as NAMES
from .writers import ExportOptions as ExportOptions
from .writers import export_fit as export_fit
