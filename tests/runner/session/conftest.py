"""What tests of sessions share."""

from __future__ import annotations

import importlib.metadata
from collections.abc import Iterator
from types import SimpleNamespace

import pytest


@pytest.fixture(scope="module")
def packages() -> Iterator[None]:
    """Read once what is installed, which each seal lists."""
    held = [SimpleNamespace(name=one.name, version=one.version) for one in importlib.metadata.distributions()]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(importlib.metadata, "distributions", lambda: held)
        yield
