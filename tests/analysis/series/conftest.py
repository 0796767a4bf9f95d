"""Choices of fifteen observers from series."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from analysis.records import SessionLog
from analysis.series import SeriesSummary, summarise_series

Maker = Callable[..., SessionLog]


@pytest.fixture(scope="session")
def fifteen(make_choices: Maker) -> list[SessionLog]:
    return [make_choices(f"{number:02d}") for number in range(1, 16)]


@pytest.fixture(scope="session")
def summary(fifteen: list[SessionLog]) -> SeriesSummary:
    return summarise_series(fifteen)
