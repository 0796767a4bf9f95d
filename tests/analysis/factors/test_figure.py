from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any
from xml.etree import ElementTree

import pytest

from analysis.comparisons import Comparisons
from analysis.factors import drawn_rows, effects_svg, factor_effects

Factors = Mapping[str, Mapping[str, str | float]]
Drawer = Callable[..., Comparisons]


def test_rows_are_the_effects_with_references_and_ranges(grid: Factors, draw: Drawer) -> None:
    answers = draw(dict.fromkeys(grid, 0.0))
    found = factor_effects(answers, grid, log=("exposure_s",))
    rows = drawn_rows(found)
    assert [(row.factor, row.level, row.is_reference) for row in rows] == [
        ("paint", "grey", True),
        ("paint", "blue", False),
        ("paint", "red", False),
        ("view", "flat", True),
        ("view", "stereo", False),
        ("exposure_s", "0.125 to 1", False),
    ]
    assert rows[1].estimate == found.effects[0].estimate
    assert rows[0].interval is None
    # Three doublings.
    assert rows[-1].estimate == pytest.approx(3 * found.effects[-1].estimate)
    assert rows[-1].interval == pytest.approx((3 * found.effects[-1].low, 3 * found.effects[-1].high))
    assert (rows[-1].robust_interval or (0, 0))[1] == pytest.approx(3 * (found.effects[-1].robust_high or 0))
    by_mean = drawn_rows(factor_effects(answers, grid, coding="sum"))
    assert not any(row.is_reference for row in by_mean)


def test_the_picture_is_sound_and_names_every_row(grid: Factors, draw: Drawer) -> None:
    told = {name: {**one, "paint": f"<b>{one['paint']}&"} for name, one in grid.items()}
    found = factor_effects(draw(dict.fromkeys(grid, 0.0)), told)
    svg = effects_svg(found)
    root = ElementTree.fromstring(svg.replace("xlink:href", "href"))
    text = ["".join(element.itertext()).strip() for element in root.iter() if element.tag.endswith("text")]
    for row in drawn_rows(found):
        assert f"{row.factor}: {row.level}" in text
    assert "3 factors" in root.attrib["aria-label"]
    assert "<b>" not in svg
    assert effects_svg(found) == svg


@pytest.mark.nightly
def test_one_interval_is_drawn_and_it_is_the_one_of_the_verdict(grid: Factors, draw: Drawer) -> None:
    found, few = (factor_effects(draw(dict.fromkeys(grid, 0.0), observers), grid) for observers in (12, 4))
    assert (found.by_observers, few.by_observers) == (True, False)
    for effects, read, other in ((found, "robust_{}", "{}"), (few, "{}", "robust_{}")):
        first = effects.effects[0]
        assert effects.interval(first) == tuple(getattr(first, read.format(end)) for end in ("low", "high"))
        for ends, changes in ((other, False), (read, True)):
            far: dict[str, Any] = {ends.format("low"): -50.0, ends.format("high"): 50.0}
            moved = replace(effects, effects=tuple(replace(one, **far) for one in effects.effects))
            assert (effects_svg(moved) != effects_svg(effects)) is changes
