"""What tests of extensions share with those of the blocks."""

from tests.runner.blocks.conftest import play, promised

__all__ = ["play", "promised"]
