"""The summary of a fit: its answer, the verdict on it, details and figures; functions are loaded when first used."""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
