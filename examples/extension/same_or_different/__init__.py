"""A same-or-different block: two pictures, one after the other; were they the same?"""

CYCLOPEAN_INTERFACE = 1
