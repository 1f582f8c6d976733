"""Running the cases of a study: each is stored as it finishes, and its heap is measured."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
