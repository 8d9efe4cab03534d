"""Metabolic cost of walking with and without a device: a study's own numbers looked at again. Knows nothing of cables.

Functions are loaded when first used.
"""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
