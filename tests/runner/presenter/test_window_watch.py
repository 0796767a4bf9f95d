"""What became of windows is reported once, however often it flickers."""

from __future__ import annotations

from dataclasses import replace

from runner.presenter.surfaces.glfw_surface import WindowState, WindowWatch


def test_changes_of_one_kind_within_half_a_second_are_one() -> None:
    states = [WindowState(True, False, (640, 480), "one")]
    watch = WindowWatch(lambda: states[-1])
    watch.settle()
    reported = []
    for step in range(100):  # dragged for a second
        states.append(replace(states[-1], size_px=(640 + step, 480), focused=False))
        watch.touch()
        reported += [what for what, _ in watch.changes(0.01 * step)]
    assert reported == ["lost_focus", "resized", "resized"]
    assert watch.waiting
    (last,) = watch.changes(5.0)
    assert last == ("resized", {"size_px": [739, 480]})
    assert not watch.changes(6.0)
