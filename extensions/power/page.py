"""A power simulation as one self-contained HTML page: curves against the number of observers, and tables."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from analysis.classes import ADJUSTMENT_NAMES
from analysis.simulation import Plan
from documents.arrays import Floats
from documents.figures import DEEP, INK, Drawing, drawing, drawn, short
from documents.pages import Beside, Column, Facts, Figure, Page, Paragraph, Section, Table
from documents.pages import write_page as write_html
from extensions.power.groups import GroupsNeeded, parts_of
from extensions.power.results import Needed
from extensions.power.tables import size_table

if TYPE_CHECKING:
    from matplotlib.axes import Axes


FAINT, SECOND = "#b9c2c9", "#b4541f"
SIZE_IN = (5.2, 3.7)
MOST_MARKED = 25
MOST_OPEN = 60
INTERVAL_NAMES = {"wald": "estimate ± quantile × standard error", "bootstrap": "observer bootstrap"}
COVARIANCE_NAMES = {
    "model": "the model's",
    "scaled": "the model's, scaled by overdispersion",
    "sandwich": "sandwich, by observer",
    "shrinkage": "shrinkage, by observer",
}


def draw_chances(needed: Needed) -> Drawing:
    """Draw the power for each pair. Pairs that matter are dark, the hardest is marked."""
    power = needed.power

    def draw(axes: Axes) -> None:
        matters = np.zeros(power.separates.shape[1], dtype=bool)
        matters[needed.pairs] = True
        _, hardest = needed.weakest
        for index in np.argsort(matters, kind="stable").tolist():
            colour, width = (DEEP, 0.9) if matters[index] else (FAINT, 0.6)
            axes.plot(power.observers, 100 * power.separates[:, index], color=colour, linewidth=width, alpha=0.7)
        first, second = power.pair_names[hardest]
        _with_error(
            axes,
            power.observers,
            100 * power.separates[:, hardest],
            100 * power.separates_error[:, hardest],
            SECOND,
            f"{short(first)} and {short(second)}",
        )
        axes.axhline(100 * needed.target, color=INK, linewidth=0.8, linestyle=(0, (5, 3)))
        axes.set(ylabel="power (%)", ylim=(-2, 102))

    return _drawn(draw, "chances", "Power for each pair of stimuli, against the number of observers")


def draw_classes(needed: Needed) -> Drawing:
    """Draw how often all classes are the right ones, and the share of pairs classified alike."""
    power = needed.power

    def draw(axes: Axes) -> None:
        pairs = 100 * power.alike, 100 * power.alike_error
        whole = 100 * power.recovery, 100 * power.recovery_error
        _with_error(axes, power.observers, *pairs, DEEP, "pairs as they should be, mean")
        _with_error(axes, power.observers, *whole, SECOND, "all pairs as they should be", "s", (0, (5, 2)))
        axes.set(ylabel="%", ylim=(-2, 102))

    return _drawn(
        draw,
        "classes",
        "Share of correct pairs and probability of exact classes, against the number of observers",
    )


def draw_widths(needed: Needed) -> Drawing:
    """Draw the mean width of the intervals of log10 scores, of each item and of all."""
    power = needed.power

    def draw(axes: Axes) -> None:
        for index in range(power.width.shape[1]):
            axes.plot(power.observers, power.width[:, index], color=FAINT, linewidth=0.8)
        _with_error(axes, power.observers, power.mean_width, power.mean_width_error, DEEP, "mean of all stimuli")
        axes.set(ylabel="width of interval (log₁₀ score)")
        axes.set_ylim(bottom=0)

    return _drawn(draw, "widths", "Mean width of the scores' intervals, against the number of observers")


def _with_error(
    axes: Axes,
    observers: tuple[int, ...],
    value: Floats,
    error: Floats,
    colour: str,
    label: str,
    marker: str = "o",
    dashes: str | tuple[float, tuple[float, ...]] = "-",
) -> None:
    marker = marker if len(observers) <= MOST_MARKED else ""
    axes.plot(
        observers,
        value,
        color=colour,
        linewidth=2,
        linestyle=dashes,
        marker=marker,
        markersize=4,
        label=label,
        zorder=4,
    )
    axes.fill_between(observers, value - 2 * error, value + 2 * error, color=colour, alpha=0.2, linewidth=0, zorder=3)


def _drawn(draw: Callable[[Axes], None], salt: str, label: str) -> Drawing:
    from matplotlib.ticker import MaxNLocator

    with drawing(salt, *SIZE_IN) as (figure, axes):
        draw(axes)
        axes.set_xlabel("observers")
        axes.xaxis.set_major_locator(MaxNLocator(integer=True, steps=[1, 2, 5, 10]))
        axes.grid(True, color=FAINT, alpha=0.4, linewidth=0.6)
        axes.spines[["top", "right"]].set_visible(False)
        if axes.get_legend_handles_labels()[1]:
            axes.legend(fontsize=8.5, frameon=False)
        return drawn(figure, label)


def write_page(needed: Needed | GroupsNeeded, output: Path, title: str, notes: Sequence[str] = ()) -> None:
    """Write the page, whole or not at all; its folder is made if need be. ``notes`` are sentences for its head.

    Parameters
    ----------
    needed
        The number of observers needed, with the power that it follows from; or that of an experiment with groups.
    output
        The HTML file.
    title
        Title of the page, in plain text.
    notes
        Sentences in plain text for the head of the page.

    Raises
    ------
    OSError
        If the page cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from extensions.power import observers_needed, simulate_power
    >>> from analysis.simulation import Plan
    >>> plan = Plan(("a", "b"), np.array([1.0, -1.0]), times=np.array([1]), differs=np.array([True]))
    >>> needed = observers_needed(simulate_power(plan, [2, 100], replicates=50, workers=1))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_page(needed, Path(folder, "power.html"), "Two views")
    ...     [file.name for file in Path(folder).iterdir()]
    ['power.html']
    """
    write_html(page_of(needed, title, notes), output)


def page_of(needed: Needed | GroupsNeeded, title: str, notes: Sequence[str] = ()) -> Page:
    """Return what the page says."""
    doubt = (Section("doubt", "Doubt", (Paragraph(needed.doubt),)),) if needed.doubt else ()
    parts = parts_of(needed)
    return Page(
        kind="Power by simulation",
        title=title,
        of="power",
        sentences=(needed.sentence,),
        notes=tuple(notes),
        sections=(*doubt, *(section for name, own in parts for section in _sections(own, name))),
    )


def _sections(needed: Needed, name: str) -> tuple[Section, ...]:
    key = f"-{name}" if name else ""
    plan, target = needed.power.plan, f"{100 * needed.target:g}\u00a0%"
    captions = (
        "Power: probability that a pair is significantly different in the right direction. Dark: the pairs that "
        f"matter; marked: the hardest of them; dashed: {target}.",
        "Pairs that share a class, or do not, as they should.",
        f"Mean width of the {100 * plan.level:g}\u00a0% intervals of log₁₀ scores; grey: single stimuli.",
    )
    drawings = draw_chances(needed), draw_classes(needed), draw_widths(needed)
    curves = tuple(
        Figure(f"power_{number}", drawing, None, caption)
        for number, (drawing, caption) in enumerate(zip(drawings, captions, strict=True), start=1)
    )
    bands = Paragraph("Bands are two Monte-Carlo standard errors wide on either side.", small=True)
    said = (Paragraph(needed.sentence),) if name else ()
    return (
        Section(f"curves{key}", "Curves", (*said, Beside(curves), bands), name),
        Section(f"sizes{key}", "By number of observers", (size_table(needed),), name),
        Section(f"pairs{key}", "By pair", (_pair_table(needed),), name),
        Section(f"simulated{key}", "What was simulated", (Facts(tuple(facts(needed))),), name),
    )


def facts(needed: Needed) -> list[tuple[str, str]]:
    """Return what was simulated, as words and values."""
    power, plan = needed.power, needed.power.plan
    order = np.argsort(-plan.theta, kind="stable")
    score = np.exp(plan.theta - np.logaddexp.reduce(plan.theta))
    return [
        ("Studies per number of observers", f"{power.replicates}, seed {power.seed}"),
        ("Assumed scores", "; ".join(f"{plan.items[item]} {score[item]:.4f}" for item in order)),
        ("Answers of each observer", _answers(plan)),
        ("Observers' own spread", f"{plan.observer_sd:g} nats (standard deviation of each stimulus's strength)"),
        ("Lapses", f"{100 * plan.lapse_rate:g} % of the answers"),
        ("Tests", f"level {plan.alpha:g}, {ADJUSTMENT_NAMES[plan.adjust]}"),
        ("Standard errors", COVARIANCE_NAMES[plan.kind(power.observers[-1])]),
        ("Intervals", f"{100 * plan.level:g} %, {INTERVAL_NAMES[plan.interval]}"),
        ("Studies in which an item won or lost all", _shares(power.observers, power.separated)),
    ]


def _answers(plan: Plan) -> str:
    each = np.atleast_2d(plan.times).sum(axis=1)
    answers = str(int(each[0])) if np.ptp(each) == 0 else f"{each.min()} to {each.max()}"
    return f"{answers}, each observer a part of the pairs" if plan.shared else answers


def _shares(observers: Sequence[int], shares: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> str:
    texts = [f"{100 * share:.1f} % with {count}" for count, share in zip(observers, shares, strict=True) if share > 0]
    return "; ".join(texts) + " (fitted by Firth's penalised likelihood)" if texts else "none"


def _pair_table(needed: Needed) -> Table:
    power, plan = needed.power, needed.power.plan
    matters = set(needed.pairs.tolist())
    first, second = plan.pairs
    apart = np.abs(plan.theta[first] - plan.theta[second])
    order = sorted(range(len(apart)), key=lambda index: (index not in matters, power.separates[-1, index]))
    columns = (
        Column("Pair", "pair"),
        Column("Apart (nats)", "apart_nats", "number", 2),
        Column(f"Observers for {100 * needed.target:g}\u00a0%", "observers", "number"),
        *(Column(str(count), f"power_percent_{count}", "number") for count in power.observers),
    )
    rows = tuple(
        (
            " and ".join(power.pair_names[index]),
            float(apart[index]),
            int(needed.by_pair[index]) or f"> {power.observers[-1]}",
            *(100 * power.separates[:, index]).tolist(),
        )
        for index in order
    )
    title = f"{len(rows)} pairs, hardest first, power in per cent by number of observers; shaded: those that matter"
    return Table("pairs", title, columns, rows, len(rows) > MOST_OPEN, shaded=range(len(matters)))


def assumed_notes(plan: Plan) -> list[str]:
    """Return sentences that a reader needs before the numbers.

    Parameters
    ----------
    plan
        The simulated study.

    Returns
    -------
    list[str]
        Sentences in plain text; empty if there is nothing to note.

    Examples
    --------
    >>> import numpy as np
    >>> theta, times, differs = np.array([1.0, -1.0]), np.array([1]), np.array([True])
    >>> assumed_notes(Plan(("a", "b"), theta, times, differs))
    []
    >>> len(assumed_notes(Plan(("a", "b"), theta, times, differs, observer_sd=0.5, covariance="model")))
    1
    """
    if plan.observer_sd > 0 and plan.covariance == "model":
        return [
            "Observers are assumed to differ, but the model's standard errors treat all answers as independent: pairs "
            "that are equal are then significant too often. Use --covariance auto, here and in the experiment."
        ]
    return []
