"""Figures (matplotlib): each is drawn on given axes or in a figure of its own and returned, never shown."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
