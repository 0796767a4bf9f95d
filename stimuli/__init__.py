"""What observers look at: pictures for two eyes in absolute XYZ.

Pictures are read, developed from photographs or made as a recipe's kind says, aligned, resampled and built into sets
that are cached by content. A rendering is compared with a photograph.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
