"""The names of matplotlib that figures use; loaded when something is drawn, by `bowdenfit.plots`."""

from matplotlib import colormaps as colormaps
from matplotlib import rc_context as rc_context
from matplotlib import rcParams as rcParams
from matplotlib import rcParamsDefault as rcParamsDefault
from matplotlib.axes import Axes as Axes
from matplotlib.figure import Figure as Figure
from matplotlib.font_manager import FontProperties as FontProperties
from matplotlib.lines import Line2D as Line2D
from matplotlib.mathtext import MathTextParser as MathTextParser
from matplotlib.patches import Patch as Patch
from matplotlib.text import Text as Text
from matplotlib.textpath import text_to_path as text_to_path
from matplotlib.ticker import FuncFormatter as FuncFormatter
from matplotlib.ticker import LogLocator as LogLocator
from matplotlib.ticker import MaxNLocator as MaxNLocator
from matplotlib.ticker import NullFormatter as NullFormatter
from matplotlib.transforms import ScaledTranslation as ScaledTranslation
