"""What a report costs: the page, and the page with every figure as SVG and PDF."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path

from curves import is_quick, program, row, seconds, sized
from promises import Promise

from analysis.records import read_results
from analysis.report import Report, describe, write_report
from analysis.report.conclusions import conclusions_of
from analysis.report.reviewers import review_of
from runner.session import simulate

EXPERIMENT, OBSERVERS = "experiments/dynamic_range.yaml", "configs/observers/table_4_4.yaml"
NUMBERS = sized((5, 30), (2,))


def run() -> dict[str, object]:
    """Report on simulated observers of ten stimuli; the error column has no meaning here."""
    rows: list[dict[str, object]] = []
    page = float("nan")
    for number in NUMBERS:
        with tempfile.TemporaryDirectory() as folder:
            place = Path(folder)
            simulate(EXPERIMENT, OBSERVERS, number, results=place / "results")
            sessions = read_results(place / "results")
            page = seconds(lambda to=place, sessions=sessions: write_report(sessions, to / "report.html"))
            rows.append(row("page", f"{number} observers", page))
            rows += _conclusions(describe(sessions), page, f"{number} observers")
            if is_quick():
                continue
            figures = seconds(
                lambda to=place, sessions=sessions: write_report(
                    sessions, to / "report.html", figure_folder=to / "figures", replace=True
                )
            )
        line = row("page and --figures", f"{number} observers", figures)
        rows.append(line)
        rows[-1]["note"] = f"{number} observers: {page:.2f} s, with figures {figures / page:.2f} × that"
    promise = Promise(f"a report on {NUMBERS[-1]} observers", page, 2.0, "seconds", unit="s")
    return {"title": "Report", "rows": rows, "promises": [promise]}


def _conclusions(report: Report, page: float, of: str) -> list[dict[str, object]]:
    """Return what of the page's time conclusions take: intervals, and in how many other analyses each stands."""
    assert report.pairs is not None
    scored = report.pairs
    works: dict[str, Callable[[], object]] = {
        "conclusions: intervals, and how robust factors are": lambda: conclusions_of(report),
        "pairs analysed in other ways, probabilities, equivalence": lambda: review_of(scored),
    }
    rows: list[dict[str, object]] = []
    for name, work in works.items():
        taken = seconds(work)
        note = f"{100 * taken / page:.0f} % of the page's time"
        rows.append(row(name, of, taken, note=note))
    return rows


if __name__ == "__main__":
    program("report", run)
