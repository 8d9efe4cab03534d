from .answer import analyze_study as analyze_study
from .answer import metabolic_text as metabolic_text
from .study import read_study as read_study
