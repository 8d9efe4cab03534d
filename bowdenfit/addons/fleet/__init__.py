"""Fitting of many cables, each inspected once or more, on one machine or a cluster."""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
