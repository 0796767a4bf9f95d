"""A session reads one picture ahead while it opens: each once, in a thread of its own, and faults where it is asked."""

from __future__ import annotations

import threading
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from runner.session.picture_source import PictureSource
from stimuli.errors import StimulusError
from stimuli.pictures import StereoImage


class Stimuli:
    """Pictures of one grey each; ``bad`` cannot be read."""

    def __init__(self) -> None:
        self.read: list[tuple[str, str]] = []

    def load(self, name: str, part: object) -> StereoImage:
        self.read.append((name, threading.current_thread().name))
        if name == "bad":
            raise StimulusError("bad")
        return StereoImage.flat(np.full((2, 3, 3), len(name), np.float32))


def source(stimuli: Stimuli) -> PictureSource:
    return PictureSource(cast(Any, SimpleNamespace(visible_part=None)), cast(Any, stimuli))


def test_each_picture_is_read_once_and_the_following_in_another_thread() -> None:
    stimuli = Stimuli()
    pictures = source(stimuli)
    with pictures.reading_ahead() as read_ahead:
        first = pictures.load("a")
        read_ahead("bb")
        assert pictures.load("a") is first
        second = pictures.load("bb")
        assert pictures.load("bb") is second
    assert second.left[0, 0, 0] == 2
    assert [name for name, _ in stimuli.read] == ["a", "bb"]
    assert stimuli.read[0][1] == threading.current_thread().name
    assert stimuli.read[1][1].startswith("read ahead")


def test_a_picture_that_cannot_be_read_is_refused_where_it_is_asked_for() -> None:
    pictures = source(Stimuli())
    with pictures.reading_ahead() as read_ahead:
        read_ahead("bad")
        with pytest.raises(StimulusError, match="bad"):
            pictures.load("bad")


def test_what_was_read_ahead_in_vain_is_forgotten() -> None:
    stimuli = Stimuli()
    pictures = source(stimuli)
    with pictures.reading_ahead() as read_ahead:
        read_ahead("bad")
    assert pictures.load("a").left[0, 0, 0] == 1
