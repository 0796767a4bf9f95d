"""Shows pictures to observers and records their answers.

An experiment file becomes a session: blocks ask, the presenter draws exactly what the display needs, every answer is on
disk before the next trial. The command line is here too.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
