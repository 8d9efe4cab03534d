from .brief import summary_text as summary_text
from .details import details_text as details_text
from .drawing import draw_into_folder as draw_into_folder
from .figure_files import prepare_figures as prepare_figures
from .forces_data import collect_forces as collect_forces
from .page import summarize as summarize
from .verdict import assess_fit as assess_fit
