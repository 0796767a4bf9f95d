"""Figures are drawn without warnings, however busy the machine is and whatever letters a name has."""

from __future__ import annotations

import time
from itertools import count

import pytest

from devices.diagnostics import Line, Panel
from documents.pages import drawing, drawn
from runner.reports.display.figure import panel_svg

LETTERS = "画像"  # not in the font that is shipped


@pytest.fixture
def _two_seconds_between_looks_at_the_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    ticks = count(step=2)
    monkeypatch.setattr(time, "perf_counter", lambda: float(next(ticks)))


@pytest.mark.usefixtures("_two_seconds_between_looks_at_the_clock")
def test_a_legend_that_takes_long_to_place_is_no_warning() -> None:
    with drawing("slow", 4.0, 2.0) as (figure, axes):
        axes.plot([0, 1], [0, 1], label=LETTERS)
        axes.legend()
        finished = drawn(figure, "Slow")
    assert LETTERS in finished.svg
    assert finished.pdf().startswith(b"%PDF-")


@pytest.mark.usefixtures("_two_seconds_between_looks_at_the_clock")
def test_a_panel_s_legend_that_takes_long_to_place_is_no_warning() -> None:
    lines = [Line(name, (0.0, 1.0), (0.0, 1.0)) for name in (LETTERS, "b")]
    assert LETTERS in panel_svg(Panel("a panel", "x", "y", tuple(lines)), "key", "what it shows")
