"""The report's figures: scores (like the thesis's Figure 4.18), classes, and values with intervals.

Perceptual classes have the hues of Figure 4.18: 1 green, 2 blue, 3 yellow, 4 brown, 5 red.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from analysis.report.summary import Summary
from analysis.report.words import percent
from analysis.scaling.scores import ItemScore
from documents.figures import DEEP, FAINT, INK, Drawing, class_colours, drawing, drawn, row_names, rows_only, short

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_NAMED = 5


def draw_scores(summary: Summary, width_in: float) -> Drawing:
    """Draw log10 scores with 95 % intervals, a row per stimulus, best at the top.

    Text stays text. An item in several classes has a marker of several colours; the class is beside each row, so that
    nothing depends on colour.
    """
    items = summary.scores.items
    with drawing("scores", width_in, 0.75 + ROW_IN * len(items)) as (figure, axes):
        _scores(axes, summary, [item.name for item in items])
        row_names(axes, {row: short(item.name) for row, item in enumerate(items)})
        axes.set_xlabel("log₁₀ score")
        return drawn(figure, f"Scores of {len(items)} stimuli with 95 % intervals")


ROW_IN = 0.31


def draw_group_scores(
    groups: Sequence[tuple[str, Summary]], names: Sequence[str], common: Mapping[str, str], width_in: float
) -> Drawing:
    """Draw a panel as of `draw_scores` for each group, on one axis of log10 scores.

    With ``names`` that stimuli have in common (``common``, by stimulus), these are the rows of all panels; without,
    each panel has its own, best at the top.
    """
    from matplotlib.ticker import MaxNLocator

    most = max(1, int((width_in - _NAMES_IN) / _SHARED_IN if names else width_in / _PANEL_IN))
    across = min(len(groups), most, 3 if len(groups) <= 9 else most)
    down = -(-len(groups) // across)
    rows = [_rows(part, names, common) if names else [item.name for item in part.scores.items] for _, part in groups]
    heights = [max(map(len, rows[line * across : (line + 1) * across])) for line in range(down)]
    height_in = 0.3 + sum(0.75 + ROW_IN * height for height in heights)
    with drawing("group scores", width_in, height_in) as (figure, axes):
        axes.remove()
        figure.set_layout_engine("constrained", h_pad=0.1)
        panels = figure.subplots(
            down,
            across,
            sharex=True,
            squeeze=False,
            gridspec_kw={"height_ratios": [height + 1.2 for height in heights]},
        )
        for number, panel in enumerate(panels.flat):
            panel.patch.set_alpha(0)
            if number >= len(groups):
                panel.set_visible(False)
                continue
            (group, part), items = groups[number], rows[number]
            _scores(panel, part, items, heights[number // across])
            panel.set_title(short(group), fontsize=10, fontweight="bold", loc="left", color=INK)
            beside = (
                (names if number % across == 0 else ("",) * len(names)) if common else [str(item) for item in items]
            )
            row_names(panel, {row: short(name) for row, name in enumerate(beside)})
            panel.xaxis.set_major_locator(MaxNLocator(4 if width_in / across > 2 else 2))
            if number + across >= len(groups):
                panel.tick_params(labelbottom=True)
                panel.set_xlabel("log₁₀ score")
        return drawn(figure, f"Scores in {len(groups)} groups with 95 % intervals")


_NAMES_IN, _SHARED_IN, _PANEL_IN = 1.2, 1.5, 3.4  # room for names; widths of a panel without them, and with its own


def _rows(part: Summary, names: Sequence[str], common: Mapping[str, str]) -> list[str | None]:
    """Return the stimulus of the group in each row, None where it has none."""
    own = {common.get(item.name, item.name): item.name for item in part.scores.items}
    return [own.get(name) for name in names]


def _scores(axes: Axes, summary: Summary, names: Sequence[str | None], height: int | None = None) -> None:
    """Draw log10 scores with intervals, classes at the right; a row for each of ``names``, empty where that is None."""
    from matplotlib.path import Path

    place = {item.name: index for index, item in enumerate(summary.scores.items)}
    rows = {row: place[name] for row, name in enumerate(names) if name is not None}
    items = {row: summary.scores.items[index] for row, index in rows.items()}
    scores = {row: item.log10_score for row, item in items.items() if item.log10_score is not None}
    shown = list(scores)
    low, high = summary.log10_interval[[rows[row] for row in shown]].T
    axes.hlines(shown, low, high, color=INK, linewidth=1.3, capstyle="butt", zorder=2)
    axes.plot([*low, *high], [*shown, *shown], "|", color=INK, markersize=7, markeredgewidth=1.3, zorder=2)
    for (part, parts), markers in _markers(scores, items).items():
        # Wedges from the top, anticlockwise: the better class on the left.
        turn = 360 / parts
        wedge = Path.wedge(90 + part * turn, 90 + (part + 1) * turn) if parts > 1 else "o"
        at, row, colours = zip(*markers, strict=True)
        axes.scatter(at, row, s=95, marker=wedge, color=colours, linewidths=0, zorder=4)
    axes.scatter(
        list(scores.values()), shown, s=95, marker="o", facecolors="none", edgecolors=INK, linewidths=1.1, zorder=5
    )
    axes.set_ylim((len(names) if height is None else height) - 0.4, -0.6)
    classes = {row: _few(item.label or "–") for row, item in items.items()}
    row_names(axes, classes, "right", fontweight="bold", color="black")
    axes.text(1.01, 1.0, "class", transform=axes.transAxes, ha="left", va="bottom", color=INK)
    axes.hlines(list(items), 0, 1, transform=axes.get_yaxis_transform(), color=FAINT, linewidth=0.7, zorder=1)
    axes.tick_params(axis="x", colors=INK)
    axes.spines[["top", "right", "left"]].set_visible(False)
    axes.spines["bottom"].set_color(INK)


def _markers(
    scores: Mapping[int, float], items: Mapping[int, ItemScore]
) -> dict[tuple[int, int], list[tuple[float, int, str]]]:
    """Return log10 score, row and colour of the markers by shape: the part and the number of parts."""
    markers: dict[tuple[int, int], list[tuple[float, int, str]]] = {}
    for row, score in scores.items():
        colours = class_colours(items[row].label)
        for part, colour in enumerate(colours):
            markers.setdefault((part, len(colours)), []).append((score, row, colour))
    return markers


def _few(label: str) -> str:
    """Return a label such as "3+4", shortened for an item in very many classes."""
    return label if label.count("+") < MOST_NAMED else "+".join(label.split("+")[:MOST_NAMED]) + "+…"


BEYOND = 0.36  # how far a bar reaches beyond its first and last stimulus, in rows


def draw_classes(summary: Summary, width_in: float) -> Drawing:
    """Draw a row per stimulus, best at the top, and a bar per class with a dot for each member.

    Where a stimulus between two members is not a member, the bar is a thin line. With a bootstrap over observers, the
    share of samples in which two neighbouring stimuli share a class is between their rows.
    """
    scores, stability = summary.scores, summary.estimate.stability
    classes = scores.classes
    assert classes is not None
    row_of = {item: row for row, item in enumerate(scores.order)}
    count = len(classes.members)
    with drawing("classes", width_in, 0.55 + 0.31 * len(scores.items)) as (figure, axes):
        axes.hlines(range(len(scores.items)), -0.6, count - 0.4, color=FAINT, linewidth=0.7, zorder=1)
        bars: list[tuple[int, float, float, str, float]] = []  # class, ends, colour and width
        dots: list[tuple[int, int]] = []
        for number, members in enumerate(classes.members):
            rows = sorted(row_of[item] for item in members)
            (colour,) = class_colours(str(number + 1))
            bars.append((number, rows[0], rows[-1], colour, 1.5))
            bars += [(number, first - BEYOND, last + BEYOND, colour, 10) for first, last in runs(rows)]
            dots += [(number, row) for row in rows]
        at, first_row, last_row, colours, widths = zip(*bars, strict=True)
        axes.vlines(at, first_row, last_row, colors=colours, linewidth=widths, capstyle="butt", zorder=2)
        axes.plot(*zip(*dots, strict=True), "o", color="white", markeredgecolor=INK, markersize=6, zorder=3)
        if stability is not None:
            for row, (item, below) in enumerate(zip(scores.order, scores.order[1:], strict=False)):
                place = {name: index for index, name in enumerate(stability.items)}
                names = scores.comparisons.items
                share = float(stability.shared[place[names[item]], place[names[below]]])
                axes.text(count - 0.25, row + 0.5, percent(share), va="center", ha="left", fontsize=8.5, color=INK)
            axes.text(count - 0.25, -0.75, "share a class", va="bottom", ha="left", fontsize=8.5, color=INK)
        row_names(axes, {row: short(item.name) for row, item in enumerate(scores.items)})
        axes.set_ylim(len(scores.items) - 0.4, -0.6)
        axes.set_xlim(-0.6, count + (0.9 if stability is not None else -0.4))
        axes.xaxis.tick_top()
        axes.set_xticks(range(count), [str(number + 1) for number in range(count)], fontweight="bold")
        axes.tick_params(length=0, colors=INK)
        axes.spines[:].set_visible(False)
        return drawn(figure, f"{count} classes of {len(scores.items)} stimuli")


def runs(rows: Sequence[int]) -> list[tuple[int, int]]:
    """Return the first and last of each stretch of neighbouring rows; ``rows`` ascend."""
    stretches: list[tuple[int, int]] = []
    for row in rows:
        if stretches and stretches[-1][1] == row - 1:
            stretches[-1] = stretches[-1][0], row
        else:
            stretches.append((row, row))
    return stretches


Row = tuple[str, float | None, float | None, float | None]


def draw_dots(rows: Sequence[Row], axis: str, title: str, width_in: float, reference: float | None = None) -> Drawing:
    """Draw for each (name, value, low, high) a dot with its interval, and a line at ``reference``."""
    with drawing(title, width_in, 0.75 + 0.31 * len(rows)) as (figure, axes):
        for place, (_, value, low, high) in enumerate(rows):
            if value is None:
                continue
            if low is not None and high is not None:
                axes.plot([low, high], [place, place], color=INK, linewidth=1.3, solid_capstyle="butt", zorder=2)
                axes.plot([low, high], [place, place], "|", color=INK, markersize=7, markeredgewidth=1.3, zorder=2)
            axes.plot([value], [place], "o", color=DEEP, markersize=8, zorder=3)
        if reference is not None:
            axes.axvline(reference, color=INK, linewidth=0.8, linestyle=(0, (4, 3)), zorder=1)
        axes.set_yticks(range(len(rows)), [short(row[0]) for row in rows])
        axes.set_ylim(len(rows) - 0.4, -0.6)
        axes.set_xlabel(short(axis, int(9 * (width_in - 2.3))), color=INK)
        rows_only(axes, len(rows))
        return drawn(figure, title)
