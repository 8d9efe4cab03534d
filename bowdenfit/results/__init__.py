"""A finished fit as data: its record, its results folder, and the best length; loaded when first used."""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
