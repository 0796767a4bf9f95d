"""What tests of extensions share with those of the runner."""

from tests.runner.blocks.conftest import play, promised
from tests.runner.conftest import unseen

__all__ = ["play", "promised", "unseen"]
