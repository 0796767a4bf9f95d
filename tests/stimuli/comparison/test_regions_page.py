"""The regions file that the page shows can be read and placed."""

from __future__ import annotations

import re
from pathlib import Path

from stimuli.comparison import place_regions, read_regions
from stimuli.comparison.regions import corner_pairs

PAGE = Path(__file__).parents[3] / "docs/regions.md"


def test_the_pages_example_can_be_placed(tmp_path: Path) -> None:
    found = re.search(r"```yaml\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert found is not None
    (tmp_path / "regions.yaml").write_text(found.group(1), encoding="utf-8")
    regions = read_regions(tmp_path / "regions.yaml")
    placed = place_regions(regions, (3000, 2600, 3), (3000, 2600, 3))
    assert len(placed.regions) == 24 + 1 + 1 + 1 + 15
    assert corner_pairs(regions, (3000, 2600, 3), (3000, 2600, 3)) is not None
