"""Curves against the number of observers, as SVG for a page."""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from analysis.power.needed import Needed

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Floats = NDArray[np.float64]

INK, FAINT, FIRST, SECOND = "#23282d", "#b9c2c9", "#165466", "#b4541f"
SIZE_IN = (5.2, 3.7)
MOST_MARKED = 25


def chances_svg(needed: Needed) -> str:
    """Return an ``<svg>``: the chance that each pair separates. Pairs that matter are dark, the hardest is marked."""
    power = needed.power

    def draw(axes: Axes) -> None:
        matters = np.zeros(power.separates.shape[1], dtype=bool)
        matters[needed.pairs] = True
        _, hardest = needed.weakest
        for index in np.argsort(matters, kind="stable").tolist():
            colour, width = (FIRST, 0.9) if matters[index] else (FAINT, 0.6)
            axes.plot(power.observers, 100 * power.separates[:, index], color=colour, linewidth=width, alpha=0.7)
        one, other = power.pair_names[hardest]
        _with_error(
            axes,
            power.observers,
            100 * power.separates[:, hardest],
            100 * power.separates_error[:, hardest],
            SECOND,
            f"{_short(one)} and {_short(other)}",
        )
        axes.axhline(100 * needed.target, color=INK, linewidth=0.8, linestyle=(0, (5, 3)))
        axes.set(ylabel="chance to separate (%)", ylim=(-2, 102))

    return _svg(draw, "chances", "Chance that each pair of stimuli separates, against the number of observers")


def classes_svg(needed: Needed) -> str:
    """Return an ``<svg>``: how often all classes are the right ones, and the share of pairs classified alike."""
    power = needed.power

    def draw(axes: Axes) -> None:
        pairs = 100 * power.alike, 100 * power.alike_error
        whole = 100 * power.recovery, 100 * power.recovery_error
        _with_error(axes, power.observers, *pairs, FIRST, "pairs as they should be, mean")
        _with_error(axes, power.observers, *whole, SECOND, "all pairs as they should be")
        axes.set(ylabel="%", ylim=(-2, 102))

    return _svg(draw, "classes", "Share of pairs and chance of all classes as they should be, against observers")


def widths_svg(needed: Needed) -> str:
    """Return an ``<svg>``: the mean width of the intervals of log10 scores, of each item and of all."""
    power = needed.power

    def draw(axes: Axes) -> None:
        for index in range(power.width.shape[1]):
            axes.plot(power.observers, power.width[:, index], color=FAINT, linewidth=0.8)
        _with_error(axes, power.observers, power.mean_width, power.mean_width_error, FIRST, "mean of all stimuli")
        axes.set(ylabel="width of interval (log₁₀ score)")
        axes.set_ylim(bottom=0)

    return _svg(draw, "widths", "Mean width of the scores' intervals, against the number of observers")


def _with_error(axes: Axes, observers: tuple[int, ...], value: Floats, error: Floats, colour: str, label: str) -> None:
    marker = "o" if len(observers) <= MOST_MARKED else ""
    axes.plot(observers, value, color=colour, linewidth=2, marker=marker, markersize=4, label=label, zorder=4)
    axes.fill_between(observers, value - 2 * error, value + 2 * error, color=colour, alpha=0.2, linewidth=0, zorder=3)


def _svg(draw: Callable[[Axes], None], salt: str, label: str) -> str:
    from matplotlib import rc_context
    from matplotlib.figure import Figure
    from matplotlib.ticker import MaxNLocator

    style = {"svg.fonttype": "none", "svg.hashsalt": salt, "text.parse_math": False, "font.size": 10.0}
    with rc_context(style):  # type: ignore[arg-type]  # its keys are known names to the stubs, and plain text here
        figure = Figure(figsize=SIZE_IN, layout="constrained")
        figure.patch.set_alpha(0)
        axes = figure.subplots()
        axes.patch.set_alpha(0)
        draw(axes)
        axes.set_xlabel("observers")
        axes.xaxis.set_major_locator(MaxNLocator(integer=True, steps=[1, 2, 5, 10]))
        axes.grid(True, color=FAINT, alpha=0.4, linewidth=0.6)
        axes.spines[["top", "right"]].set_visible(False)
        if axes.get_legend_handles_labels()[1]:
            axes.legend(fontsize=8.5, frameon=False)
        out = io.StringIO()
        figure.savefig(out, format="svg", metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    return _inline(out.getvalue(), label)


def _inline(svg: str, label: str) -> str:
    """Drop what only a file of its own needs: the XML prologue, metadata, name spaces and the fixed size."""
    body = re.sub(r"<metadata>.*?</metadata>", "", svg[svg.index("<svg") :], flags=re.DOTALL)
    head, rest = body.split(">", 1)
    view = re.search(r'viewBox="[^"]*"', head)
    return f'<svg {view.group(0) if view else ""} role="img" aria-label="{label}">{rest}'


def _short(name: str) -> str:
    return name if len(name) <= 20 else name[:19] + "…"
