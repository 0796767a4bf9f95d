"""Ratings of single stimuli (mean opinion scores), and preferences between stereo and flat."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.ratings.preferences import KIND, Preferences
from analysis.ratings.ratings import RatingSummary, ScaleSummary
from analysis.records.session_record import SessionLog
from analysis.report.blocks import Column, Figure, Paragraph, Section, Table
from analysis.report.figures import dots_svg
from analysis.report.summary import wilson_interval
from analysis.report.words import fixed, p_words, percent
from analysis.series.observer_means import Estimate, means
from documents.pages.drawing import NARROW_IN, WIDE_IN


def ratings_section(summary: RatingSummary) -> Section:
    """Return a figure with its table for each scale, and how observers used it."""
    blocks: list[Figure | Table] = []
    for scale in summary.scales:
        blocks += [_scores(scale), _raters(scale)]
    return Section("ratings", "Ratings", tuple(blocks))


def _scores(scale: ScaleSummary) -> Figure:
    columns = (
        Column("Stimulus", "stimulus"),
        Column("Mean", "mean", "number", 2),
        Column("95 %", "mean", "interval", 2),
        Column("s.d.", "sd", "number", 2),
        Column("z", "z", "number", 2),
        Column("95 %", "z", "interval", 2),
        Column("Observers", "observers", "number"),
    )
    rows = tuple(
        (
            one.stimulus,
            one.mean,
            one.interval or (None, None),
            one.sd,
            one.z,
            one.z_interval or (None, None),
            one.observers,
        )
        for one in scale.scores
    )
    title = f"Mean opinion scores: {scale.scale}"
    dots = [(one.stimulus, one.mean, *(one.interval or (None, None))) for one in scale.scores]
    drawn = [dots_svg(dots, scale.scale, title, width) for width in (WIDE_IN, NARROW_IN)]
    caption = (
        f"{title}, each observer's mean counting once, with 95 % intervals by Student's t. z: in standard deviations "
        "of each observer's own ratings."
    )
    return Figure(drawn[0], drawn[1], caption, Table(f"ratings_{scale.scale}", title, columns, rows))


def _raters(scale: ScaleSummary) -> Table:
    columns = (
        Column("Observer", "observer"),
        Column("Ratings", "ratings", "number"),
        Column("Mean", "mean", "number", 2),
        Column("s.d.", "sd", "number", 2),
        Column("Far above", "above", "number"),
        Column("Far below", "below", "number"),
        Column("BT.500", "bt500"),
    )
    rows = tuple(
        (one.observer, one.ratings, one.mean, one.sd, one.above, one.below, "to look at" if one.flagged else None)
        for one in scale.observers
    )
    title = f"How observers used the scale {scale.scale}; BT.500's rule is information, nobody is left out by it"
    return Table(f"raters_{scale.scale}", title, columns, rows, folded=True)


Floats = NDArray[np.float64]


def preferences_section(sessions: Sequence[SessionLog], found: Preferences) -> Section:
    """Return how often stereo was preferred: of each picture, altogether, and by each observer."""
    people = list(found.by_observer)
    pictures = _pictures(sessions)
    total, count = np.zeros((len(people), len(pictures) + 1)), np.zeros((len(people), len(pictures) + 1))
    for session in sessions:
        for trial in session.trials:
            if trial.kind == KIND:
                row = people.index(session.header.observer)
                for column in (pictures.index(_picture(trial.data)), len(pictures)):
                    total[row, column] += trial.data["chosen_view"] == "stereo"
                    count[row, column] += 1
    names = [*pictures, "all pictures"]
    estimates = [
        _unanimous(one, by_picture) if one.value in (0.0, 1.0) else one
        for one, by_picture in zip(means(total, count), count.T, strict=True)
    ]
    dots = [(name, one.value, one.low, one.high) for name, one in zip(names, estimates, strict=True)]
    title = "Share of choices for the stereo version"
    table = Table(
        "preferences",
        title,
        (
            Column("Picture", "picture"),
            Column("Stereo", "stereo", "number"),
            Column("of", "of", "number"),
            Column("Share", "share", "number", 2),
            Column("95 %", "share", "interval", 2),
        ),
        tuple(
            (name, stereo, of, one.value, (one.low, one.high))
            for name, one, stereo, of in zip(
                names, estimates, total.sum(axis=0).tolist(), count.sum(axis=0).tolist(), strict=True
            )
        ),
    )
    caption = (
        f"{title}, with 95 % intervals from observers drawn anew, or Wilson's over the observers where all of them "
        "agree; dashed: no preference."
    )
    drawn = [dots_svg(dots, title.lower(), title, width, reference=0.5) for width in (WIDE_IN, NARROW_IN)]
    by_observer = Table(
        "preferences_by_observer",
        "By observer",
        (Column("Observer", "observer"), Column("Stereo", "stereo", "number"), Column("Flat", "flat", "number")),
        tuple((name, stereo, flat) for name, (stereo, flat) in found.by_observer.items()),
        folded=len(people) > 12,
    )
    figure = Figure(drawn[0], drawn[1], caption, table)
    return Section("preferences", "Stereo or flat", (Paragraph(_words(found)), figure, by_observer))


def _unanimous(one: Estimate, count: Floats) -> Estimate:
    """Return the estimate with Wilson's interval, each observer counting once: draws of those who agree all agree."""
    people = int((count > 0).sum())
    low, high = wilson_interval(float(one.value or 0.0), people)
    return replace(one, low=max(low, 0.0), high=min(high, 1.0)) if people > 1 else one


def _words(found: Preferences) -> str:
    """Say what came out, with the sign test over observers."""
    decided = found.observers_for_stereo + found.observers_for_flat
    share = found.stereo / (found.stereo + found.flat)
    words = f"{found.sentence} Stereo has {percent(share, 1)} of the choices."
    if decided:
        p = sign_test(found.observers_for_stereo, decided)
        words += (
            f" Sign test over the {fixed(decided, 0)} observers who lean to one side: {p_words(p)} if neither version "
            "is preferred."
        )
    return words


def sign_test(count: int, of: int) -> float:
    """Return the chance of a split at least as uneven as ``count`` of ``of``, if both sides are as likely."""
    from scipy.special import bdtr

    return min(1.0, 2 * float(bdtr(min(count, of - count), of, 0.5)))


def _pictures(sessions: Sequence[SessionLog]) -> list[str]:
    """Return what the pictures are called, in the header's order."""
    place = {str(stimulus["name"]): number for number, stimulus in enumerate(sessions[0].header.stimuli)}
    named = {
        _picture(trial.data): place.get(str(trial.data["first"]), len(place))
        for session in sessions
        for trial in session.trials
        if trial.kind == KIND
    }
    return sorted(named, key=lambda name: (named[name], name))


def _picture(data: Mapping[str, Any]) -> str:
    """Return what the names of both versions begin with, or both, the stereo one first."""
    both = [str(data["first"]), str(data["second"])]
    if data.get("first_view") == "flat":
        both.reverse()
    shared = both[0].removesuffix("stereo")
    if shared != both[0] and shared == both[1].removesuffix("flat"):
        return shared.rstrip(" -_") or " / ".join(both)
    return " / ".join(both)
