from . import metabolic_figure as metabolic_figure
from .answer import analyze_study as analyze_study
from .study import read_study as read_study
