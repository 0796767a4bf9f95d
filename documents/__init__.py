"""Files that people write and files that must survive a crash.

YAML is read with the place of every value, checked against strict schemas, and every fault of a file is reported at
once with line, column and remedy. Files are written whole or not at all; logs are durable, line by line.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
