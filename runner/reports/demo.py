"""The thesis's second experiment from recipe to report, with simulated observers."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Annotated, ClassVar

import numpy as np

from analysis.choices import Adjust
from analysis.classes import classify
from analysis.records import read_results
from analysis.report import Report, report_blocks, write_report
from analysis.scaling import Published, Scores, fit
from documents.options import Typed
from documents.pages import Block
from documents.text import JsonResult
from runner.observers.observer_file import read_scored_observer
from runner.presenter.counters import Counters
from runner.protocol.shipped import shipped_experiment, shipped_folder
from runner.reports.thumbnails import thumbnails
from runner.session.folders import new_label
from runner.session.picture_source import Progress, no_progress
from runner.session.run import simulate


@dataclass(frozen=True, slots=True)
class Demo(JsonResult):
    """What the demonstration gives.

    ``report`` has the default analysis: level 0.05, Holm's correction, errors by observers. ``thesis`` has the same
    answers by the thesis's settings, which the experiment file names beside: a higher share of false differences.
    ``published`` is each stimulus's score and class in the thesis's Table 4.4; ``agreement`` compares ``thesis`` with
    it, None without a fit. ``expects_published_classes`` says whether the counts that the published scores lead so many
    observers to on average give exactly the published classes by those settings.
    ``work`` is the presenter's, ``took_s`` the time of all of it.
    """

    report: Report
    page: Path
    thesis: Scores
    published: dict[str, tuple[float, str]]
    agreement: ThesisAgreement | None
    expects_published_classes: bool
    work: Counters
    observers: int
    took_s: float
    json_names: ClassVar = "report.pairs thesis page work"
    json_keys: ClassVar = {"report.pairs": "scores", "thesis": "thesis_settings", "page": "report"}

    def told(self) -> Iterator[Block | str]:
        """Yield the results, what the thesis's settings mean, how they agree with it, and where the report is."""
        yield from report_blocks(self.report, self.published)
        yield (
            "The thesis's settings, which stand beside, do not correct for 45 tests and take all answers for "
            "independent: more classes, and more false ones. A study of your own should keep the analysis above."
        )
        if self.agreement:
            yield (
                f"Agreement with Table 4.4: the log scores correlate at r = {self.agreement.correlation:.3f}; "
                f"{self.agreement.pairs_alike} of {self.agreement.pairs} pairs share a class, or do not, as published."
            )
            if self.expects_published_classes:
                yield (
                    f"The counts that the published scores lead {self.observers} observers to on average give exactly "
                    "the published classes by these settings; the rest is the luck of the draw."
                )
        yield f"All of it took {self.took_s:.0f} s. The report: {self.page}"


def run_demo(
    observers: Annotated[int, Typed(least=1, most=999)] = 30,
    *,
    window: bool = False,
    results: str | Path = "results/demo",
    progress: Progress = no_progress,
) -> Demo:
    """Repeat the thesis's second experiment with simulated observers.

    Builds ten stimuli from configs/stimuli/manitoba_gray.yaml, shows all 45 pairs in stereo to every simulated
    observer, who answers by the thesis's published scores (Table 4.4), records each answer, fits Bradley-Terry
    scores and perceptual classes, and writes a report. The classes are those of the default analysis; the thesis's
    settings stand beside it.

    Parameters
    ----------
    observers
        Number of simulated observers.
    window
        Draw in a window that you can watch.
    results
        Folder that the sessions are written to.
    progress
        Called with what is being done, how much of it is done, and of how much.

    Returns
    -------
    Demo
        The report, where it is written, and how it agrees with the thesis.
    """
    began_s = time.monotonic()
    answering = shipped_folder() / "configs" / "observers" / "table_4_4.yaml"
    published = {
        name: (stimulus.score, stimulus.perceptual_class)
        for name, stimulus in read_scored_observer(answering).stimuli.items()
    }
    folder = Path(results) / new_label()
    done = simulate(
        shipped_experiment("dynamic_range"),
        answering,
        observers,
        results=folder,
        backend="window" if window else "egl",
        progress=progress,
    )
    progress("Writing the report", 0, 1)
    page = folder / "report.html"
    pictures = thumbnails(done.experiment, done.stimuli)
    report = write_report(read_results(folder), page, published=published, thumbnails=pictures)
    progress("Writing the report", 1, 1)
    thesis, theirs = report.pairs.beside if report.pairs else None, done.experiment.spec.analysis.beside
    if thesis is None or theirs is None:
        raise RuntimeError("the demonstration's observers compared no pairs, or the thesis's settings are not beside")
    classes = expected_classes(published, observers, theirs.alpha, theirs.adjust)
    expected = classes == {name: label for name, (_, label) in published.items()}
    agrees, took_s = agreement(thesis, published), time.monotonic() - began_s
    return Demo(report, page, thesis, published, agrees, expected, done.work, observers, took_s)


@dataclass(frozen=True, slots=True)
class ThesisAgreement:
    """``correlation`` is Pearson's between log scores; ``pairs_alike`` of ``pairs`` share a class, or not, in both."""

    correlation: float
    pairs_alike: int
    pairs: int


def _share(label: str, second: str) -> bool:
    return bool(set(label.split("+")) & set(second.split("+")))


def agreement(scores: Scores, published: Published) -> ThesisAgreement | None:
    """Compare ``scores`` with ``published`` (score, class) per item; None if there is no fit or an item is missing."""
    items = scores.items
    if len(items) < 3 or any(item.log10_score is None or item.name not in published for item in items):
        return None
    ours = [item.log10_score or 0.0 for item in items]
    theirs = [np.log10(published[item.name][0]) for item in items]
    alike = sum(
        _share(a.label or "", b.label or "") == _share(published[a.name][1], published[b.name][1])
        for a, b in combinations(items, 2)
    )
    return ThesisAgreement(float(np.corrcoef(ours, theirs)[0, 1]), alike, len(items) * (len(items) - 1) // 2)


def expected_classes(published: Published, observers: int, alpha: float, adjust: Adjust) -> dict[str, str]:
    """Return the classes that ``observers`` give on average if they answer every pair once by the published scores.

    Each pair's expected counts, observers · p_ij, take the place of answers.
    """
    names = list(published)
    strength = np.array([published[name][0] for name in names])
    wins = observers * strength[:, None] / (strength[:, None] + strength)
    np.fill_diagonal(wins, 0.0)
    fitted = fit(wins)
    labels = classify(fitted.theta, fitted.covariance, alpha=alpha, adjust=adjust).labels
    return dict(zip(names, labels, strict=True))
