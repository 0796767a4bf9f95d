"""What the answers mean; answers alone, no pictures.

Records of sessions and tables of comparisons become scores with their intervals, perceptual classes, tests
of series, a table of observers, a report, and what a planned study can find.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
