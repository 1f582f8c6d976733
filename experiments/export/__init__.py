"""Cards and tests for other codes: contacts in their words, and the same test as their input."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
