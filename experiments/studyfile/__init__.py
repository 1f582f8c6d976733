"""Studies: one TOML file each, its sections and units, every rule checked with the place of a breach."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
