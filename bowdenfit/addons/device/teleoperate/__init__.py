"""What a hand feels of a remote wall through a cable, and which walls it touches without bouncing."""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
