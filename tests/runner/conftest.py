"""What tests of the runner share."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from runner.presenter.drawing import Drawing


@pytest.fixture(scope="module")
def unseen() -> Iterator[None]:
    """Make all that frames are made of and draw none: for tests of what a session reads and records."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Drawing, "frame", lambda *_, **__: None)
        yield
