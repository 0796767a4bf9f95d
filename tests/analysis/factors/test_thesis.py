"""Experiment 2 of the thesis: what Section 4.5.2.3 says of its factors, from the scores of Table 4.4."""

from __future__ import annotations

from collections.abc import Mapping

import pytest

from analysis.comparisons import Comparisons
from analysis.factors import FactorEffects, factor_effects
from tests.kept import known

Factors = Mapping[str, Mapping[str, str | float]]


@pytest.fixture
def three(thesis: tuple[Comparisons, Factors]) -> FactorEffects:
    """The thesis's three factors: stereoscopy, exposure, and whether the dynamic range was adapted."""
    answers, factors = thesis
    wishes: dict[str, str | float] = {"view": "flat", "exposure_s": 0.125, "tone_mapped": "no"}
    return factor_effects(answers, factors, use=tuple(wishes), references=wishes)


def test_the_table_of_the_docs(three: FactorEffects) -> None:
    """Stereo clearly preferred, medium exposures before short before long ones, tone-mapped ones preferred less."""
    assert [effect.level for effect in three.effects] == ["stereo", "0.0666667", "1", "yes"]
    assert [effect.estimate for effect in three.effects] == pytest.approx([0.90, -0.18, -0.48, -0.63], abs=0.005)
    assert [test.statistic for test in three.tests] == pytest.approx([128.6, 21.2, 51.2], abs=0.05)
    assert [test.df for test in three.tests] == [1, 2, 1]


def test_the_factors_explain_nearly_all(three: FactorEffects) -> None:
    told = known(three.explained)
    assert told.deviance_share is not None
    assert told.r_squared is not None
    assert told.deviance_share > 0.95
    assert told.r_squared > 0.94
    assert told.lack_of_fit_p is not None
    assert told.lack_of_fit_p > 0.05


def test_image_and_view_as_the_recipe_has_them(thesis: tuple[Comparisons, Factors]) -> None:
    """Image takes up exposure and scale. Stereo has the largest test, though the images lie further apart."""
    answers, factors = thesis
    found = factor_effects(answers, factors, references={"view": "flat", "image": "3.2"})
    assert [one.name for one in found.left_out] == ["exposure_s", "luminance_scale", "tone_mapped"]
    assert all("'image' already explains" in one.reason for one in found.left_out)
    image, view = found.tests
    assert (image.name, image.df, view.name, view.df) == ("image", 4, "view", 1)
    assert view.statistic > image.statistic
    effect = {one.level: one.estimate for one in found.effects}
    order = sorted(("1.1", "1.2", "2.1", "3.1", "3.2"), key=lambda image: -effect.get(image, 0.0))
    assert order == ["2.1", "1.1", "3.1", "1.2", "3.2"]
    assert 0.85 < effect["stereo"] < effect["2.1"] < 1.1
    (interaction,) = found.interactions
    assert interaction.df == 4
    assert found.explained is not None
    # The interaction makes the model free: what it gains is all that was lacking.
    assert interaction.statistic == pytest.approx(found.explained.lack_of_fit, abs=1e-9)
