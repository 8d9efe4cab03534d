from . import compensation_figure as compensation_figure
from . import compensation_traces_figure as compensation_traces_figure
from .simulation import answer_compensation as answer_compensation
