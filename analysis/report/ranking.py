"""The significance figure of graphics papers: stimuli by score, those that are not distinguished joined.

Each stimulus is a triangle at its score, best at the top, as the ranking triangles of [PerezOrtiz2017] stand on their
axis. Below the axis there is a line for each class: it joins the stimuli between which no difference is significant.
"""

from __future__ import annotations

from analysis.report.figures import ROW_IN
from analysis.report.summary import Summary
from documents.figures import FAINT, INK, Drawing, class_colours, drawing, drawn, rows_only, short

MOST_LINES = 12
"""Classes up to which the figure is drawn; nobody reads more lines below one axis."""
_LINE_ROWS = 0.7  # between two lines, in rows


def draws_ranking(summary: Summary) -> bool:
    """Return whether there is something to draw: classes, not too many, and a score of every stimulus."""
    classes = summary.scores.classes
    scored = all(item.log10_score is not None for item in summary.scores.items)
    return classes is not None and len(classes.members) <= MOST_LINES and scored


def draw_ranking(summary: Summary, width_in: float) -> Drawing:
    """Draw a triangle for each stimulus at its log10 score, and a line for each class with a dot at each member.

    A stimulus between the ends of a line that has no dot on it is not of its class. A class of one stimulus is its
    dot alone.
    """
    scores = summary.scores
    classes = scores.classes
    assert classes is not None
    items = scores.items
    at = [float(item.log10_score or 0.0) for item in items]
    place = {item: row for row, item in enumerate(scores.order)}
    rows = len(items) + 0.2 + _LINE_ROWS * len(classes.members)
    with drawing("ranking", width_in, 0.75 + ROW_IN * rows) as (figure, axes):
        axes.vlines(at, range(len(items)), rows - 0.4, color=FAINT, linewidth=0.7, zorder=1)
        axes.scatter(at, range(len(items)), s=70, marker="v", color=INK, linewidths=0, zorder=4)
        ticks = []
        for number, members in enumerate(classes.members):
            line = len(items) + 0.2 + _LINE_ROWS * number
            (colour,) = class_colours(str(number + 1))
            dots = sorted(at[place[item]] for item in members)
            axes.plot([dots[0], dots[-1]], [line, line], color=colour, linewidth=3.5, solid_capstyle="butt", zorder=2)
            axes.plot(dots, [line] * len(dots), "o", color="white", markeredgecolor=INK, markersize=5, zorder=3)
            ticks.append(line)
        axes.set_yticks(
            [*range(len(items)), *ticks],
            [*(short(item.name) for item in items), *(f"class {number + 1}" for number in range(len(ticks)))],
        )
        axes.yaxis.set_label_coords(0.0, 0.5)
        axes.set_ylim(rows - 0.4, -0.6)
        axes.set_xlabel("log₁₀ score", color=INK)
        rows_only(axes, 0)
        return drawn(figure, f"Ranking of {len(items)} stimuli, with lines that join those not significantly different")
