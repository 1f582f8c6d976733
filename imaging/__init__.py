"""Pictures and repose angles: heaps and photographs in, angles with their uncertainty out.

Pictures are OpenCV's: uint8, row 0 at the top, grey or blue-green-red. Angles of heaps are in degrees,
directions of cameras in radians, lengths in metres or, where said so, in pixels.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
