"""Whatever `check` calls right opens: many experiments, drawn at random; and enough of them are right."""

from __future__ import annotations

from collections import Counter

import pytest
from hypothesis import given, settings

from tests.runner.generated_experiments import experiments, what_check_calls_right_opens
from tests.stress.how_many import how_many

pytestmark = pytest.mark.stress
EXAMPLES = how_many(80, 200)


def test_what_check_calls_right_opens(tmp_path_factory: pytest.TempPathFactory) -> None:
    folder = tmp_path_factory.mktemp("drawn")
    verdicts: Counter[bool] = Counter()

    @given(drawn=experiments())
    @settings(max_examples=EXAMPLES, deadline=None)
    def try_one(drawn: dict[str, object]) -> None:
        verdicts[what_check_calls_right_opens(drawn, folder)] += 1

    try_one()
    assert verdicts[True] >= EXAMPLES // 20
    assert verdicts[False] >= EXAMPLES // 20
