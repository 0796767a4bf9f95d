"""Figures are drawn without warnings, however busy the machine is and whatever letters a name has."""

from __future__ import annotations

import io
import re
import time
from collections.abc import Callable
from itertools import count
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from devices.diagnostics import PlotAxes, Trace
from documents.figures import INK, drawing, drawn, row_names
from runner.reports import draw_panel

LETTERS = "画像"  # not in the font that is shipped


@pytest.fixture
def _two_seconds_between_looks_at_the_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    ticks = count(step=2)
    monkeypatch.setattr(time, "perf_counter", lambda: float(next(ticks)))


def words(write: Callable[[Axes, dict[int, str]], None], names: dict[int, str]) -> tuple[list[Any], np.ndarray]:
    """Return the texts of a figure with names beside its rows, and their places in points."""
    with drawing("names", 4.0, 0.3 * len(names)) as (figure, axes):
        axes.plot([0, 1], [0, len(names)])
        axes.set_ylim(-0.6, len(names) - 0.4)
        write(axes, names)
        axes.set_xlabel("x")
        svg = drawn(figure, "names").svg
    texts = [*ElementTree.fromstring(svg.replace("xlink:", "")).iter("text")]
    look = [(text.text, re.findall("text-anchor: ([a-z]+)", str(text.get("style")))) for text in texts]
    order = sorted(range(len(texts)), key=lambda number: str(texts[number].text))
    places = np.array([[float(str(text.get(key))) for key in "xy"] for text in texts])
    return [look[number] for number in order], places[order]


@pytest.mark.parametrize("side", ["left", "right"])
def test_names_stand_where_labels_of_ticks_would(side: Any) -> None:
    def by_ticks(axes: Axes, names: dict[int, str]) -> None:
        axes.tick_params(axis="y", length=0, colors=INK, **{f"label{side}": True})
        if side == "right":
            axes.tick_params(axis="y", labelleft=False)
        axes.set_yticks(list(names), [*names.values()])

    names = dict(enumerate(["plate", "sphere, the widest of them", "Å", "W" * 9, LETTERS, "", "g"]))
    texts, places = words(lambda axes, given: row_names(axes, given, side), names)
    expected, expected_places = words(by_ticks, names)
    assert texts == expected
    np.testing.assert_allclose(places, expected_places, atol=1e-4)


def test_a_figure_is_drawn_once_and_as_by_savefig(monkeypatch: pytest.MonkeyPatch) -> None:
    draws = []
    real = Figure.draw

    def counted(figure: Figure, renderer: Any) -> None:
        draws.append(figure)
        real(figure, renderer)

    def made(*, once: bool) -> str:
        with drawing("once", 4.0, 2.0) as (figure, axes):
            axes.plot([0, 1], [0, 1e5], label="a line")
            axes.set_ylabel("words that take room")
            axes.legend()
            if once:
                return drawn(figure, "once").svg
            out = io.StringIO()
            figure.savefig(out, format="svg")
            return out.getvalue()

    monkeypatch.setattr(Figure, "draw", counted)
    svg = made(once=True)
    assert len(draws) == 1
    assert svg[svg.index("<defs>") :].strip() in made(once=False)


@pytest.mark.usefixtures("_two_seconds_between_looks_at_the_clock")
def test_a_panel_s_legend_that_takes_long_to_place_is_no_warning() -> None:
    lines = [Trace(name, (0.0, 1.0), (0.0, 1.0)) for name in (LETTERS, "b")]
    assert LETTERS in draw_panel(PlotAxes("a panel", "x", "y", tuple(lines)), "what it shows").svg
