"""Style, layout and elements that all figures share; matplotlib (`plots.mpl`) is loaded when something is drawn."""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
