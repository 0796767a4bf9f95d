"""What tests of measuring share: whether pictures can be drawn without a window."""

from __future__ import annotations

import pytest

from documents import InputError
from runner.presenter import open_surface


@pytest.fixture(scope="session")
def egl() -> None:
    """Skip where nothing can be drawn."""
    try:
        open_surface("egl", (8, 8)).close()
    except InputError as error:
        pytest.skip(str(error))
