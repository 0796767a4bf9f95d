"""What tests of the runner share."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from runner.presenter.drawing import SceneDrawing


@pytest.fixture(scope="module")
def unseen() -> Iterator[None]:
    """Make all that frames are made of and draw none: for tests of what a session reads and records."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(SceneDrawing, "frame", lambda *_, **__: None)
        yield


@pytest.fixture(autouse=True, scope="module")
def few_studies() -> Iterator[None]:
    """Simulate as few studies as there may be of a design for the smallest difference that it finds."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("analysis.simulation.smallest.MOST_STUDIES", 60)
        yield
