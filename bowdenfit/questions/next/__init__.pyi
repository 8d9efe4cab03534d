from . import next_figure as next_figure
from .ranking import open_fit as open_fit
from .ranking import rank_measurements as rank_measurements
from .words import TITLE as TITLE
from .words import ranking_blocks as ranking_blocks
from .words import ranking_section as ranking_section
