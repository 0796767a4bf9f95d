"""Choices of the best picture of a series: scores, ratings, just noticeable steps, agreement, and tests.

The results of blocks of the kind ``best_of_series``, the thesis's first experiment [Medina2016, Section 4.5.1];
`analysis.series.summary` computes all of them.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
