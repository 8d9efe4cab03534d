from .page import FIGURES_TITLE as FIGURES_TITLE
from .page import figures_section as figures_section
from .page import report_page as report_page
from .page import write_report as write_report
