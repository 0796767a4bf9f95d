"""How many observers a study needs: statistical power by simulation of whole studies, here or on a lab's machines."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
