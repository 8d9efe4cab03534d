"""Pooling of a fleet: a hierarchical model of its cables, outliers, wear, life and the next inspection."""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
