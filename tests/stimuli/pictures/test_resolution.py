"""What a display's pixels keep of a picture: the thesis's figures and Nyquist's."""

from __future__ import annotations

import json
import math

import pytest

from documents import InputError
from stimuli.pictures import display_resolution
from stimuli.pictures.resolution import Resolution

# The plate of the thesis: 150 × 100 mm at 700 mm, 146 camera pixels per centimetre, on pixels of 0.2768 mm.
PLATE = ((2190, 1460), (150.0, 100.0))


@pytest.fixture
def plate() -> Resolution:
    return display_resolution(*PLATE, 0.2768, 700.0)


def test_both_figures(plate: Resolution) -> None:
    fov = math.degrees(2 * math.atan(150 / 1400))
    assert plate.needed_px[0] == pytest.approx(fov * 60)
    assert plate.nyquist_px[0] == pytest.approx(fov * 120)
    assert plate.display_px == (542, 361)
    per_degree = 2 * 700 * math.tan(math.radians(0.5)) / 0.2768
    assert plate.display_cycles_per_degree == pytest.approx(per_degree / 2)
    assert plate.picture_cycles_per_degree == pytest.approx(per_degree / 2 * 0.2768 * 14.6)


def test_what_is_lost_is_said(plate: Resolution) -> None:
    assert plate.lost_cycles_per_degree == (plate.display_cycles_per_degree, plate.picture_cycles_per_degree)
    assert plate.seen_and_lost == (plate.display_cycles_per_degree, 60.0)
    grid, lost = plate.sentences()
    assert "542 pixels" in grid
    assert "need 1468" in grid
    assert "from 22.1 to 89.2" in lost
    assert "up to 60.0" in lost
    assert json.loads(json.dumps(plate.to_json()))["lost_cycles_per_degree"] == list(plate.lost_cycles_per_degree)


def test_nothing_is_lost_of_a_coarse_picture_or_far_away() -> None:
    coarse = display_resolution((200, 150), (150.0, 100.0), 0.2768, 700.0)
    assert coarse.lost_cycles_per_degree is None
    assert len(coarse.sentences()) == 1
    # The coarser of the two axes is what the picture is sure to hold.
    assert coarse.picture_cycles_per_degree == pytest.approx(
        display_resolution((200, 9000), (150.0, 100.0), 1, 700).picture_cycles_per_degree
    )
    far = display_resolution(*PLATE, 0.2768, 4000.0)
    assert far.lost_cycles_per_degree is not None
    assert far.seen_and_lost is None
    assert "cannot see" in far.sentences()[0]
    between = display_resolution(*PLATE, 0.2768, 1200.0)
    assert "the 60 that eyes resolve need" in between.sentences()[0]
    assert "there is the one pixel per cycle" in between.sentences()[0]
    for one in (coarse, far, between):
        assert "Expression" not in " ".join(one.sentences()), "words for people who do not have the thesis"


@pytest.mark.parametrize(
    ("picture", "size", "pitch", "distance"),
    [((0, 5), (1.0, 1.0), 0.2, 700.0), ((5, 5), (1.0, 1.0), 0.2, 0.0)],
)
def test_what_cannot_be(picture: tuple[int, int], size: tuple[float, float], pitch: float, distance: float) -> None:
    with pytest.raises(InputError):
        display_resolution(picture, size, pitch, distance)
