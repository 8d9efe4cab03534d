"""Export of a fitted cable for other programs: C, FMI, MATLAB, MuJoCo, YAML and CSV."""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
