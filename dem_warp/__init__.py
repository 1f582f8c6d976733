"""Discrete element simulation of clumped grains on NVIDIA Warp: many worlds at once, on a GPU or a CPU."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
