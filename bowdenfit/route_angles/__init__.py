"""Wrap angles from routes: points along a sheath to the angle that it turns through, with the error that theirs leaves.

Functions are loaded when first used, since SciPy's splines take longer than reading a table.
"""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
