"""Which monitor a window opens on, chosen by name or number, and what is said where it does not fit."""

from __future__ import annotations

from dataclasses import replace
from itertools import count

import glfw
import pytest
from hypothesis import given
from hypothesis import strategies as st

from runner.presenter import PresentationError, monitors, primary_monitor
from runner.presenter.surfaces.screens import NOT_READ, Monitor, choose_monitors, place_two_windows, place_window
from runner.presenter.surfaces.windows import WindowSurface
from tests.runner import two_monitors

LAPTOP = Monitor("eDP-1", (1366, 768), 60.0, NOT_READ, (0, 0), (344, 194), 1)
RIG = Monitor("DP-1", (1920, 1080), 120.0, NOT_READ, (1366, 0), (531, 299), 2)
SAME = Monitor("DP-1 #2", (1920, 1080), None, NOT_READ, (3286, 0), (0, 0), 3)
THERE = (LAPTOP, RIG, SAME)


@pytest.mark.parametrize(
    ("wanted", "numbers"),
    [((), []), (("2",), [2]), (("DP-1",), [2]), (("dp-1 #2",), [3]), (("3", "2"), [3, 2]), (("eDP-1", "3"), [1, 3])],
)
def test_a_monitor_is_chosen_by_name_or_number(wanted: tuple[str, ...], numbers: list[int]) -> None:
    assert [monitor.number for monitor in choose_monitors(THERE, wanted)] == numbers


@pytest.mark.parametrize("wanted", ["4", "0", "HDMI-1", "", "-1"])
def test_a_monitor_that_is_not_there_is_refused_with_all_that_are(wanted: str) -> None:
    with pytest.raises(PresentationError) as told:
        choose_monitors(THERE, (wanted,))
    assert (
        "there are: 1 'eDP-1': 1366 x 768 px at 60 Hz, 344 x 194 mm, at 0,0, primary; "
        "2 'DP-1': 1920 x 1080 px at 120 Hz, 531 x 299 mm, at 1366,0; "
        "3 'DP-1 #2': 1920 x 1080 px, refresh rate not known, size in mm not known, at 3286,0"
    ) in str(told.value)


def test_a_name_that_is_a_number_goes_before_the_number() -> None:
    assert choose_monitors((replace(LAPTOP, name="2"), RIG), ("2",))[0].number == 1


def test_a_window_is_on_the_named_monitor_else_on_the_first_that_fits() -> None:
    first = place_window((1920, 1080), THERE)
    assert (first.monitors, first.full_screen, first.remark) == ((RIG,), True, None)
    assert place_window((1920, 1080), THERE, ("3",)).monitors == (SAME,)
    named = place_window((1280, 720), THERE, ("2",))
    assert (named.monitors, named.full_screen, named.too_large) == ((RIG,), False, False)
    assert (named.remark or "").startswith("the monitor 'DP-1' shows 1920 × 1080 px, not 1280 × 720 px")
    assert place_window((1920, 1080), THERE, windowed=True).monitors == (RIG,)  # the first that holds it
    assert place_window((640, 480), THERE, windowed=True).remark is None


@pytest.mark.parametrize("windowed", [False, True])
@pytest.mark.parametrize("wanted", [(), ("1",)])
def test_a_panel_larger_than_the_screen_is_told_with_both_sizes(wanted: tuple[str, ...], windowed: bool) -> None:
    placed = place_window((1920, 1080), (LAPTOP,), wanted, windowed=windowed)
    assert placed.too_large
    assert "1366 × 768" in str(placed.remark)
    assert "1920 × 1080" in str(placed.remark)
    assert "what lies beyond the screen's edges is not seen" in str(placed.remark)


def test_a_window_as_large_as_all_monitors_together_is_spread_over_them() -> None:
    """Two projectors side by side, one for each eye, as one desktop in the mode side-by-side."""
    pair = (replace(SAME, position_px=(0, 0)), replace(RIG, position_px=(1920, 0)))
    placed = place_window((3840, 1080), pair[::-1])
    assert (placed.monitors, placed.full_screen, placed.too_large) == ((pair[0],), False, False)
    assert place_window((3840, 1080), (pair[0], replace(pair[1], position_px=(1920, 10)))).too_large
    assert place_window((3840, 1080), pair, ("2",)).too_large


def test_two_windows_are_left_to_right_or_as_named() -> None:
    assert place_two_windows((1920, 1080), (SAME, LAPTOP, RIG)).monitors == (RIG, SAME)
    assert place_two_windows((1920, 1080), THERE, ("3", "2")).monitors == (SAME, RIG)
    for wanted, why in (
        (("2",), "and one is named"),
        (("2", "2"), "named for both eyes"),
        (("1", "2"), r"1366 × 768 and 1920 × 1080"),
    ):
        with pytest.raises(PresentationError, match=why):
            place_two_windows((1920, 1080), THERE, wanted)
    with pytest.raises(PresentationError, match="two are named"):
        place_window((1920, 1080), THERE, ("2", "3"))


SIZES = st.tuples(st.integers(1, 4000), st.integers(1, 4000))


@given(SIZES, st.lists(SIZES, min_size=1, max_size=4), st.booleans())
def test_a_window_that_is_not_called_too_large_is_seen_whole(
    size_px: tuple[int, int], screens: list[tuple[int, int]], windowed: bool
) -> None:
    lefts = [sum(width for width, _ in screens[:index]) for index in range(len(screens))]
    there = [
        Monitor(f"m{number}", size, 60.0, NOT_READ, (left, 0), number=number)
        for number, size, left in zip(count(1), screens, lefts, strict=False)
    ]
    placed = place_window(size_px, there, windowed=windowed)
    left, top = placed.monitors[0].position_px
    seen_px = sum(
        max(0, min(left + size_px[0], m.position_px[0] + m.size_px[0]) - max(left, m.position_px[0]))
        * max(0, min(top + size_px[1], m.size_px[1]) - top)
        for m in there
    )
    if not placed.too_large:
        assert seen_px == size_px[0] * size_px[1]
    else:
        assert not any(a >= size_px[0] and b >= size_px[1] for a, b in screens)


@pytest.fixture
def laptop(display: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A laptop's monitor beside the real one, which is number 2."""
    names = ("get_monitors", "get_monitor_name", "get_video_mode", "get_monitor_pos", "get_monitor_physical_size")
    for name in (*names, "get_gamma_ramp"):
        monkeypatch.setattr(glfw, name, getattr(glfw, name))  # what is changed now is restored after
    two_monitors.add_laptop()


@pytest.mark.window
@pytest.mark.usefixtures("laptop")
def test_a_real_window_fills_the_monitor_that_is_named() -> None:
    assert [(each.number, each.name, each.size_px) for each in monitors()] == [
        (1, "eDP-1", (1366, 768)),
        (2, "screen", (640, 480)),
    ]
    for wanted in ((), ("2",), ("screen",)):
        with WindowSurface((640, 480), monitors=wanted) as window:
            assert glfw.get_window_monitor(window._window)
            assert window.facts.remarks == ()
            assert window.facts.monitors[0].startswith("2 'screen': 640 x 480 px")
    with WindowSurface((640, 480), monitors=("1",)) as window:
        assert not glfw.get_window_monitor(window._window)
        assert window.facts.refresh_hz == 60.0
        assert "the monitor 'eDP-1' shows 1366 × 768 px, not 640 × 480 px" in window.facts.remarks[0]
    reported = primary_monitor(("2",))
    assert reported is not None
    assert reported.name == "screen"


@pytest.mark.window
def test_a_window_larger_than_its_screen_is_refused_before_it_opens_where_that_is_asked(display: str) -> None:
    with pytest.raises(PresentationError, match=r"no screen shows 800 × 700 px \(there: 640 × 480\) .*--wrong-screen"):
        WindowSurface((800, 700), refuse_larger=True)
    with WindowSurface((800, 700)) as window:
        assert window.facts.larger_than_screen
