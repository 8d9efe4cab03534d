from .writers import ExportOptions as ExportOptions
from .writers import export_fit as export_fit
from .writers import load_formats as load_formats
