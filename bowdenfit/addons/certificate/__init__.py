"""Certificates of a fit: results by the GUM, conformity by JCGM 106, as a page and as a Digital Calibration Certificate (DCC).

Functions are loaded when first used.
"""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
