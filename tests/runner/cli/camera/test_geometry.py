from __future__ import annotations

import json
from functools import partial

import pytest

from documents import InputError
from tests.invoked import invoked

CAMERA = ("--sensor-mm", "36x24", "--pixels", "7360x4912")


run = partial(invoked, "camera", "geometry", *CAMERA)


def test_the_thesis_s_camera() -> None:
    result = run("--focal-mm", 50, "--distance-mm", 700, "--lens", "pinhole", "--size-mm", "150×100")
    assert result.exit_code == 0
    lines = result.output.splitlines()
    assert "Resolution: 14.6 pixels per mm across, 14.62 down" in lines
    assert "Picture: 504.0 × 336.0 mm of the plane" in lines
    assert lines[-1] == "A sample of 150 × 100 mm: 2190 × 1462 pixels"


def test_the_third_follows_from_two() -> None:
    found = json.loads(run("--focal-mm", 50, "--px-per-mm", 14.6, "--json").output)
    again = json.loads(run("--distance-mm", found["distance_mm"], "--px-per-mm", 14.6, "--json").output)
    assert again["focal_mm"] == pytest.approx(50)
    forward = json.loads(run("--focal-mm", 50, "--distance-mm", found["distance_mm"], "--json").output)
    assert forward["pixels_per_mm"][0] == pytest.approx(14.6)


WRONG = ("", "--distance-mm 700 --size-mm 15cm", "--pixels 7.5x10", "--distance-mm 700 --px-per-mm 3")


@pytest.mark.parametrize("words", WRONG)
def test_wrong_input_is_refused(words: str) -> None:
    result = run("--focal-mm", 50, *words.split())
    assert isinstance(result.exception, InputError) or result.exit_code == 2


def test_a_lens_that_gives_no_image_is_named() -> None:
    result = run("--focal-mm", 105, "--distance-mm", 300, "--distance-from", "sensor")
    assert isinstance(result.exception, InputError)
    assert "4 × 105 = 420 mm" in str(result.exception)
