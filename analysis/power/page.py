"""A power simulation as one self-contained HTML page: curves against the number of observers, and tables."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from analysis.classes.multiplicity import ADJUSTMENT_NAMES
from analysis.power.groups import GroupsNeeded, parts_of
from analysis.power.plan import Plan
from analysis.power.results import Needed
from analysis.power.tables import size_rows
from documents.files import write_whole
from documents.pages import DEEP, INK, drawing, page_environment, short, svg_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes


Floats = NDArray[np.float64]

FAINT, SECOND = "#b9c2c9", "#b4541f"
SIZE_IN = (5.2, 3.7)
MOST_MARKED = 25
INTERVAL_NAMES = {"wald": "estimate ± quantile × standard error", "bootstrap": "observer bootstrap"}
COVARIANCE_NAMES = {
    "model": "the model's",
    "scaled": "the model's, scaled by overdispersion",
    "sandwich": "sandwich, by observer",
    "shrinkage": "shrinkage, by observer",
}


def chances_svg(needed: Needed, salt: str = "") -> str:
    """Return an ``<svg>``: the power for each pair. Pairs that matter are dark, the hardest is marked."""
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

    return _svg(draw, f"chances{salt}", "Power for each pair of stimuli, against the number of observers")


def classes_svg(needed: Needed, salt: str = "") -> str:
    """Return an ``<svg>``: how often all classes are the right ones, and the share of pairs classified alike."""
    power = needed.power

    def draw(axes: Axes) -> None:
        pairs = 100 * power.alike, 100 * power.alike_error
        whole = 100 * power.recovery, 100 * power.recovery_error
        _with_error(axes, power.observers, *pairs, DEEP, "pairs as they should be, mean")
        _with_error(axes, power.observers, *whole, SECOND, "all pairs as they should be", "s", (0, (5, 2)))
        axes.set(ylabel="%", ylim=(-2, 102))

    return _svg(
        draw,
        f"classes{salt}",
        "Share of correct pairs and probability of exact classes, against the number of observers",
    )


def widths_svg(needed: Needed, salt: str = "") -> str:
    """Return an ``<svg>``: the mean width of the intervals of log10 scores, of each item and of all."""
    power = needed.power

    def draw(axes: Axes) -> None:
        for index in range(power.width.shape[1]):
            axes.plot(power.observers, power.width[:, index], color=FAINT, linewidth=0.8)
        _with_error(axes, power.observers, power.mean_width, power.mean_width_error, DEEP, "mean of all stimuli")
        axes.set(ylabel="width of interval (log₁₀ score)")
        axes.set_ylim(bottom=0)

    return _svg(draw, f"widths{salt}", "Mean width of the scores' intervals, against the number of observers")


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


def _svg(draw: Callable[[Axes], None], salt: str, label: str) -> str:
    from matplotlib.ticker import MaxNLocator

    with drawing(salt, *SIZE_IN) as (figure, axes):
        draw(axes)
        axes.set_xlabel("observers")
        axes.xaxis.set_major_locator(MaxNLocator(integer=True, steps=[1, 2, 5, 10]))
        axes.grid(True, color=FAINT, alpha=0.4, linewidth=0.6)
        axes.spines[["top", "right"]].set_visible(False)
        if axes.get_legend_handles_labels()[1]:
            axes.legend(fontsize=8.5, frameon=False)
        return svg_of(figure, label)


@dataclass(frozen=True, slots=True)
class PairRow:
    """One pair in words: its names, how far apart it is in nats, how many observers it needs, its chances in %."""

    name: str
    apart: str
    needed: str
    chances: tuple[str, ...]
    matters: bool


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
    >>> from analysis.power import Plan, observers_needed, simulate_power
    >>> plan = Plan(("a", "b"), np.array([1.0, -1.0]), times=np.array([1]), differs=np.array([True]))
    >>> needed = observers_needed(simulate_power(plan, [2, 100], replicates=50, workers=1))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_page(needed, Path(folder, "power.html"), "Two views")
    ...     [file.name for file in Path(folder).iterdir()]
    ['power.html']
    """
    page = render(needed, title, notes)
    write_whole(output, page)


def render(needed: Needed | GroupsNeeded, title: str, notes: Sequence[str] = ()) -> str:
    """Return the page's HTML; text from people is escaped."""
    from markupsafe import Markup

    environment = page_environment("analysis.power", "analysis.report")
    return environment.get_template("power.html.j2").render(
        title=title,
        needed=needed,
        notes=notes,
        parts=[
            {
                "name": name,
                "needed": own,
                "plan": own.power.plan,
                "observers": own.power.observers,
                "rows": size_rows(own),
                "pairs": _pair_rows(own),
                "facts": facts(own),
                # matplotlib escapes the text that it writes.
                "chances": Markup(chances_svg(own, str(number))),
                "classes": Markup(classes_svg(own, str(number))),
                "widths": Markup(widths_svg(own, str(number))),
            }
            for number, (name, own) in enumerate(parts_of(needed))
        ],
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


def _pair_rows(needed: Needed) -> list[PairRow]:
    power, plan = needed.power, needed.power.plan
    matters = set(needed.pairs.tolist())
    first, second = plan.pairs
    apart = np.abs(plan.theta[first] - plan.theta[second])
    order = sorted(range(len(apart)), key=lambda index: (index not in matters, power.separates[-1, index]))
    return [
        PairRow(
            name=" and ".join(power.pair_names[index]),
            apart=f"{apart[index]:.2f}",
            needed=str(needed.by_pair[index] or f"> {power.observers[-1]}"),
            chances=tuple(f"{100 * chance:.0f}" for chance in power.separates[:, index]),
            matters=index in matters,
        )
        for index in order
    ]


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
