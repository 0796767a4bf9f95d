"""Each picture of a session is read once while it is kept, counted, and handed to whoever computes its costs."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from runner.session.picture_source import PictureSource
from stimuli.errors import StimulusError
from stimuli.pictures import StereoImage


class Stimuli:
    """Pictures of one grey each; ``bad`` cannot be read."""

    def load(self, name: str, part: object) -> StereoImage:
        if name == "bad":
            raise StimulusError("bad")
        return StereoImage.flat(np.full((2, 3, 3), len(name), np.float32))


def source() -> PictureSource:
    return PictureSource(cast(Any, SimpleNamespace(visible_part=None)), cast(Any, Stimuli()))


def test_each_picture_is_read_once_and_handed_on_whenever_it_is_loaded() -> None:
    pictures = source()
    handed: list[tuple[str, StereoImage]] = []
    pictures.on_read = lambda name, image: handed.append((name, image))
    first, second = pictures.load("a"), pictures.load("bb")
    assert pictures.load("a") is first
    assert pictures.stimulus("bb") is second
    assert second.left[0, 0, 0] == 2
    assert pictures.read == 2
    assert handed == [("a", first), ("bb", second), ("a", first)]


def test_a_picture_that_a_block_makes_is_no_stimulus() -> None:
    pictures = source()
    made = StereoImage.flat(np.zeros((2, 3, 3), np.float32))
    pictures.add([cast(Any, SimpleNamespace(pictures={"disc": lambda: made}))])
    pictures.on_read = lambda name, image: pytest.fail(f"{name} was handed on")
    assert pictures.load("disc") is made
    assert pictures.read == 0


def test_a_picture_that_cannot_be_read_is_refused_where_it_is_asked_for() -> None:
    with pytest.raises(StimulusError, match="bad"):
        source().load("bad")
