"""The classes drawn: stimuli by score, a bar for each class over the stimuli that it holds [Piepho2004]."""

from __future__ import annotations

from collections.abc import Sequence

from analysis.report.palette import class_colours
from analysis.report.summary import Summary
from analysis.report.words import percent
from documents.pages.drawing import FAINT, INK, drawing, short, svg_of

BEYOND = 0.36  # how far a bar reaches beyond its first and last stimulus, in rows


def classes_svg(summary: Summary, width_in: float) -> str:
    """Return an ``<svg>``: a row per stimulus, best at the top, and a bar per class with a dot for each member.

    Where a stimulus between two members is none itself, the bar is a thin line.

    Where observers were drawn anew, between each two rows stands in how many of the draws they share a class.
    """
    scores, stability = summary.scores, summary.estimate.stability
    classes = scores.classes
    assert classes is not None
    row_of = {item: row for row, item in enumerate(scores.order)}
    count = len(classes.members)
    with drawing("classes", width_in, 0.55 + 0.31 * len(scores.items)) as (figure, axes):
        axes.hlines(range(len(scores.items)), -0.6, count - 0.4, color=FAINT, linewidth=0.7, zorder=1)
        for number, members in enumerate(classes.members):
            rows = sorted(row_of[item] for item in members)
            (colour,) = class_colours(str(number + 1))
            axes.plot([number] * 2, [rows[0], rows[-1]], color=colour, linewidth=1.5, zorder=2)
            for first, last in runs(rows):
                ends = [first - BEYOND, last + BEYOND]
                axes.plot([number] * 2, ends, color=colour, linewidth=10, solid_capstyle="butt", zorder=2)
            axes.plot([number] * len(rows), rows, "o", color="white", markeredgecolor=INK, markersize=6, zorder=3)
        if stability is not None:
            for row, (one, other) in enumerate(zip(scores.order, scores.order[1:], strict=False)):
                place = {name: index for index, name in enumerate(stability.items)}
                names = scores.comparisons.items
                share = float(stability.shared[place[names[one]], place[names[other]]])
                axes.text(count - 0.25, row + 0.5, percent(share), va="center", ha="left", fontsize=8.5, color=INK)
            axes.text(count - 0.25, -0.75, "share a class", va="bottom", ha="left", fontsize=8.5, color=INK)
        axes.set_yticks(range(len(scores.items)), [short(item.name) for item in scores.items])
        axes.set_ylim(len(scores.items) - 0.4, -0.6)
        axes.set_xlim(-0.6, count + (0.9 if stability is not None else -0.4))
        axes.xaxis.tick_top()
        axes.set_xticks(range(count), [str(number + 1) for number in range(count)], fontweight="bold")
        axes.tick_params(length=0, colors=INK)
        axes.spines[:].set_visible(False)
        return svg_of(figure, f"{count} classes of {len(scores.items)} stimuli")


def runs(rows: Sequence[int]) -> list[tuple[int, int]]:
    """Return the first and last of each stretch of neighbouring rows; ``rows`` rise."""
    found: list[tuple[int, int]] = []
    for row in rows:
        if found and found[-1][1] == row - 1:
            found[-1] = found[-1][0], row
        else:
            found.append((row, row))
    return found
