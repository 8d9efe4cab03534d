from . import mpl as mpl
from . import page as page
