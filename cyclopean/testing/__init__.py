"""What proves an extension: the promises that every kind of ours keeps, tried on a kind of yours.

A test of an extension is one call::

    def test_it_keeps_the_promises(tmp_path):
        prove_block("kind: same_or_different, trials: 6", tmp_path)
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
