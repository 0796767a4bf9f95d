"""Whatever `check` accepts runs, and whatever ran is reported, exported and replayed: many experiments, with pages."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis.strategies import SearchStrategy

from tests.runner.generated_experiments import write
from tests.runner.mixed_experiments import mixed_experiments, mutants
from tests.runner.whole_way import whole_way
from tests.stress.how_many import how_many

pytestmark = pytest.mark.stress
EXAMPLES = how_many(50, 200)


@pytest.mark.parametrize(("drawn_from", "fewest"), [(mixed_experiments, EXAMPLES // 5), (mutants, EXAMPLES // 20)])
def test_many_experiments_the_whole_way(
    drawn_from: Callable[[], SearchStrategy[dict[str, Any]]],
    fewest: int,
    tmp_path_factory: pytest.TempPathFactory,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path_factory.mktemp("cache")))
    written = tmp_path_factory.mktemp("written")
    verdicts: Counter[bool] = Counter()

    @given(drawn=drawn_from())
    @settings(max_examples=EXAMPLES, suppress_health_check=list(HealthCheck))
    def try_one(drawn: dict[str, Any]) -> None:
        file: Path = write(drawn, written)
        way = tmp_path_factory.mktemp("way")
        page = sum(verdicts.values()) % 8 == 0
        verdicts[whole_way(file, written / "observers.yaml", way / "new", page=page)] += 1

    try_one()
    assert verdicts[True] >= fewest
