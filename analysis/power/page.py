"""A power simulation as one HTML page that needs nothing but itself."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from analysis.power.figure import chances_svg, classes_svg, widths_svg
from analysis.power.needed import Needed
from analysis.power.plan import Plan
from analysis.power.rows import size_rows
from analysis.report.page import ADJUSTMENT_NAMES
from documents.files.whole_file import write_whole
from documents.pages.environment import page_environment

INTERVAL_NAMES = {"wald": "estimate ± quantile × standard error", "bootstrap": "observer bootstrap"}
COVARIANCE_NAMES = {"model": "the model's", "sandwich": "sandwich, by observer, Student's t"}


@dataclass(frozen=True, slots=True)
class PairRow:
    """One pair in words: its names, how far apart it is in nats, how many observers it needs, its chances in %."""

    name: str
    apart: str
    needed: str
    chances: tuple[str, ...]
    matters: bool


def write_page(needed: Needed, output: Path, title: str, notes: Sequence[str] = ()) -> None:
    """Write the page, whole or not at all; its folder is made if need be. ``notes`` are sentences for its head.

    Raises
    ------
    OSError
        If the page cannot be written.
    """
    page = render(needed, title, notes)
    write_whole(output, page)


def render(needed: Needed, title: str, notes: Sequence[str] = ()) -> str:
    """Return the page's HTML; text from people is escaped."""
    from markupsafe import Markup

    environment = page_environment("analysis.power", "analysis.report")
    return environment.get_template("power.html.j2").render(
        title=title,
        needed=needed,
        plan=needed.power.plan,
        notes=notes,
        observers=needed.power.observers,
        rows=size_rows(needed),
        pairs=_pair_rows(needed),
        facts=facts(needed),
        # matplotlib escapes the text that it writes.
        chances=Markup(chances_svg(needed)),
        classes=Markup(classes_svg(needed)),
        widths=Markup(widths_svg(needed)),
    )


def facts(needed: Needed) -> list[tuple[str, str]]:
    """Return what was simulated, as words and values."""
    power, plan = needed.power, needed.power.plan
    order = np.argsort(-plan.theta, kind="stable")
    score = np.exp(plan.theta - np.logaddexp.reduce(plan.theta))
    return [
        ("Studies per number of observers", f"{power.replicates}, seed {power.seed}"),
        ("Assumed scores", "; ".join(f"{plan.items[item]} {score[item]:.4f}" for item in order)),
        ("Answers of each observer", str(int(plan.times.sum()))),
        ("Observers' own spread", f"{plan.observer_sd:g} nats (standard deviation of each stimulus's strength)"),
        ("Lapses", f"{100 * plan.lapse_rate:g} % of the answers"),
        ("Tests", f"level {plan.alpha:g}, {ADJUSTMENT_NAMES[plan.adjust]}"),
        ("Standard errors", COVARIANCE_NAMES[plan.covariance]),
        ("Intervals", f"{100 * plan.level:g} %, {INTERVAL_NAMES[plan.interval]}"),
        ("Studies in which an item won or lost all", _shares(power.observers, power.separated)),
    ]


def _shares(observers: Sequence[int], shares: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> str:
    told = [f"{100 * share:.1f} % with {count}" for count, share in zip(observers, shares, strict=True) if share > 0]
    return "; ".join(told) + " (fitted by Firth's penalised likelihood)" if told else "none"


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
    """Return what a reader must know before the numbers."""
    if plan.observer_sd > 0 and plan.covariance == "model":
        return [
            "Observers are assumed to differ, but the model's standard errors take all answers for independent: pairs "
            "that are equal then come out different too often. --covariance sandwich allows for it."
        ]
    return []
