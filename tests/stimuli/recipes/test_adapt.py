"""The step `adapt`: against colour-science on whole pictures, what it skips, and wrong input."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from colour.adaptation import chromatic_adaptation_VonKries
from numpy.typing import NDArray
from pydantic import ValidationError

from devices.colour import white_point
from stimuli.errors import StimulusError
from stimuli.pictures import StereoImage
from stimuli.recipes.picture_steps import adapted, finished_picture
from stimuli.recipes.steps_spec import AdaptSpec, StepsSpec


def picture(seed: int = 1) -> NDArray[np.float32]:
    return np.random.default_rng(seed).uniform(20.0, 60.0, (33, 20, 3)).astype(np.float32)


def spec(**keys: Any) -> AdaptSpec:
    return AdaptSpec.model_validate({"from_white": "A", "to_white": "d65", **keys})


@pytest.mark.parametrize(
    ("method", "theirs"), [("cat16", "CAT16"), ("von-kries", "Von Kries"), ("bradford", "Bradford")]
)
def test_each_eye_is_that_of_colour_science(method: str, theirs: str) -> None:
    image = StereoImage(picture(1), picture(2))
    shown, step = adapted(image, spec(method=method))
    whites = white_point("a", 1.0), white_point("d65", 1.0)
    for eye, before in ((shown.left, image.left), (shown.right, image.right)):
        plain = chromatic_adaptation_VonKries(before.astype(np.float64), *whites, transform=theirs)
        # One rounding to single precision of what is equal in double.
        np.testing.assert_allclose(eye, np.maximum(plain, 0), rtol=6.1e-8, atol=0)
    assert step["pixels_computed"] == 2 * 33 * 20


def test_grey_keeps_its_luminance_and_a_flat_picture_is_computed_once() -> None:
    grey = np.broadcast_to(white_point("a", 40.0), (8, 9, 3)).astype(np.float32)
    shown, step = adapted(StereoImage.flat(grey), spec())
    np.testing.assert_allclose(shown.left, np.broadcast_to(white_point("d65", 40.0), (8, 9, 3)), rtol=2e-7)
    assert shown.is_flat
    assert step["pixels_computed"] == 72


@pytest.mark.parametrize("keys", [{"degree": 0.0}, {"to_white": "a"}, {"to_white": [1.09850, 1.0, 0.35585]}])
def test_what_changes_nothing_is_not_computed(keys: dict[str, Any]) -> None:
    image = StereoImage.flat(picture())
    shown, step = adapted(image, spec(**keys))
    assert shown is image
    assert step["pixels_computed"] == 0


def test_it_comes_before_the_luminance() -> None:
    steps = StepsSpec.model_validate(
        {"adapt": {"from_white": "a", "to_white": "d65"}, "luminance": {"mean_cd_m2": 25.0}}
    )
    shown, done = finished_picture(StereoImage.flat(picture()), steps, None, 0.25, None)
    assert [step["step"] for step in done] == ["chromatic_adaptation", "adapt"]
    assert float(shown.left[..., 1].mean()) == pytest.approx(25.0, rel=1e-6)


def test_light_below_zero_is_refused_or_clipped() -> None:
    light = picture()
    light[3, 4] = light[5, 6] = [0.0, 30.0, 0.0]  # no light has it; noise in the dark does
    image = StereoImage.flat(light)
    with pytest.raises(StimulusError, match="2 pixels get negative light") as raised:
        adapted(image, spec(method="bradford"))
    assert "negative: clip" in str(raised.value)
    shown, step = adapted(image, spec(method="bradford", negative="clip"))
    assert step["clipped_pixels"] == 2
    assert float(shown.left.min()) == 0.0


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"from_white": "d56"}, "d65"),
        ({"from_white": 5}, "write a name such as d65"),
        ({"to_white": [0.3]}, "write a name such as d65"),
        ({"to_white": [0.3, 0.0]}, "no light has it"),
        ({"to_white": [0.7, 0.6]}, "no light has it"),
        ({"to_white": [0.2, 1.0, 9.0], "method": "bradford"}, "too saturated"),
        ({"degree": 1.1}, "less than or equal to 1"),
        ({"method": "cat02"}, "cat16"),
    ],
)
def test_wrong_input_is_one_message(keys: dict[str, Any], message: str) -> None:
    with pytest.raises(ValidationError) as raised:
        spec(**keys)
    errors = raised.value.errors()
    assert len(errors) == 1
    assert message in errors[0]["msg"]


def test_whites_are_stated_in_three_ways() -> None:
    image = StereoImage.flat(picture())
    white = white_point("a", 80.0)
    by_name, _ = adapted(image, spec())
    by_XYZ, _ = adapted(image, spec(from_white=white.tolist()))
    by_xy, _ = adapted(image, spec(from_white=(white[:2] / white.sum()).tolist()))
    np.testing.assert_allclose(by_XYZ.left, by_name.left, rtol=1e-6)
    np.testing.assert_allclose(by_xy.left, by_name.left, rtol=1e-6)


def test_another_observer_is_said() -> None:
    _, step = adapted(StereoImage.flat(picture()), spec(), "CIE 1964 10")
    assert "CIE 1964 10" in str(step["said"])
    assert step["from_white_XYZ"] == pytest.approx(white_point("a", 1.0, "CIE 1964 10").tolist())
