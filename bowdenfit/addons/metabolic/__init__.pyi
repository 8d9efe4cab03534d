from .answer import analyze_study as analyze_study
from .study import read_study as read_study
