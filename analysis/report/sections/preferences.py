"""Stereo or flat: shares of choices by picture and by observer."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from analysis.preferences import KIND, Preferences
from analysis.records import SessionLog
from analysis.report.blocks import Column, Figure, Paragraph, Section, Table
from analysis.report.dot_figure import dots_svg
from analysis.report.drawing import NARROW_IN, WIDE_IN
from analysis.report.words import fixed, p_words, percent


def preferences_section(sessions: Sequence[SessionLog], found: Preferences) -> Section:
    """Return how often stereo was preferred: of each picture, altogether, and by each observer."""
    from analysis.best_of_series.observer_means import means

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
    estimates = means(total, count)
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
    caption = f"{title}, with 95 % intervals from observers drawn anew; dashed: no preference."
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


def _words(found: Preferences) -> str:
    """Say what came out, with the sign test over observers."""
    from scipy.stats import binomtest

    decided = found.observers_for_stereo + found.observers_for_flat
    share = found.stereo / (found.stereo + found.flat)
    words = f"{found.sentence} Stereo has {percent(share, 1)} of the choices."
    if decided:
        p = float(binomtest(found.observers_for_stereo, decided).pvalue)
        words += (
            f" Sign test over the {fixed(decided, 0)} observers who lean to one side: {p_words(p)} if neither version "
            "is preferred."
        )
    return words


def _pictures(sessions: Sequence[SessionLog]) -> list[str]:
    """Return what the pictures are called, in the header's order."""
    named = dict.fromkeys(
        _picture(trial.data) for session in sessions for trial in session.trials if trial.kind == KIND
    )
    place = {str(stimulus["name"]): number for number, stimulus in enumerate(sessions[0].header.stimuli)}
    return sorted(named, key=lambda name: (place.get(name.split(" / ")[0], len(place)), name))


def _picture(data: object) -> str:
    """Return the names of both versions, the stereo one first."""
    assert isinstance(data, dict)
    both = [str(data["first"]), str(data["second"])]
    if data.get("first_view") == "flat":
        both.reverse()
    return " / ".join(both)
