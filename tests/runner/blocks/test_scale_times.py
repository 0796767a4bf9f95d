"""The time that a rating takes, where presses move the marker and where they do not."""

from __future__ import annotations

from runner.blocks.block import Response
from runner.blocks.scale import Scale, rate
from runner.blocks.style import FULL_HD_HALF


def test_time_on_a_screen_that_a_press_left_as_it_was_counts_once() -> None:
    """At the end of the scale an arrow moves nothing: times go on counting from the onset of the same screen."""
    asking = rate(Scale("similarity", "How similar?"), FULL_HD_HALF)
    next(asking)
    presses = [("0", "10", 1.0), ("right", "higher", 2.0), ("right", "higher", 3.0), ("enter", "accept", 4.5)]
    try:
        for key, meaning, time_s in presses:
            asking.send(Response(key, meaning, time_s))
    except StopIteration as done:
        value, took_s = done.value
    assert value == 10
    assert took_s == 1.0 + 4.5
