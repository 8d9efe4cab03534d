from . import comparison_figure as comparison_figure
from .answer import compare_fits as compare_fits
from .two_cables import contrast_cables as contrast_cables
from .two_cables import shared_files as shared_files
from .words import comparison_blocks as comparison_blocks
from .words import comparison_page as comparison_page
