"""What reviewers ask of scores: chances of pairs, equivalence, transitivity, residuals, model choice, robustness."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
