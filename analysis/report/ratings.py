"""Ratings of stimuli, alone (mean opinion scores) or after a choice, and preferences between stereo and flat."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from analysis.classes.conclusions import Conclusion, concluded, with_shares
from analysis.kinds.preference import PreferenceRecord
from analysis.ratings.ratings import Preferences, RatingSummary, ScaleSummary, preferences, ratings_in
from analysis.records.answered_by import WhoAnswered, who_answered
from analysis.records.session_record import SessionLog
from analysis.report.checks import FailedCheck
from analysis.report.figures import draw_dots
from analysis.report.part import Part, draws_of_means
from analysis.report.references import Citations
from analysis.report.summary import wilson_interval
from analysis.report.words import counted, fixed, listed, p_words, percent, some
from analysis.series.observer_means import Estimated, means
from documents.arrays import Floats
from documents.figures import NARROW_IN, WIDE_IN
from documents.pages import Column, Figure, Paragraph, Section, Table

# By what was rated: the title of its scores, that of its observers, what its caption adds, and the end of its names.
_TITLES = {
    "alone": ("Mean opinion scores: {}", "Ratings by observer on the scale {}", "", ""),
    "chosen": (
        "Mean ratings of the stimuli chosen of two: {}",
        "Ratings by observer of the stimuli chosen of two on the scale {}",
        " A stimulus was rated only when it was chosen, so that its mean also depends on what it was chosen over.",
        "_chosen",
    ),
    "both": (
        "Mean ratings of both stimuli of a pair: {}",
        "Ratings by observer of both stimuli of a pair on the scale {}",
        " Both stimuli of each pair were rated after the choice between them.",
        "_both",
    ),
}


# By what was rated, what follows: its number of ratings, a scale in a check that failed, and a choice in Methods.
_COUNTED = {"alone": "", "chosen": " of the stimuli chosen of two", "both": " of both stimuli of a pair"}
_CHECKED = {"alone": "", "chosen": ", of stimuli chosen of two", "both": ", of both stimuli of pairs"}
_AFTER = {"chosen": "the stimulus chosen was", "both": "both stimuli were"}
_INTERVALS = {True: "that stay on the scale", False: "by Student's t, since a log does not say where the scale ends"}


def ratings_part(sessions: Sequence[SessionLog]) -> Part | None:
    """Return what a report says of ratings of stimuli, alone or after a choice; None without any."""
    summary = ratings_in(sessions)
    if summary is None:
        return None
    return Part(
        key="ratings",
        result=summary,
        sentences=tuple(_sentences(summary, who_answered(sessions))),
        sections=lambda pictures: (ratings_section(summary, pictures),),
        failed=tuple(_failed(summary)),
        task=tuple(_task(summary)),
        analysis=lambda cited: _analysis(summary, cited),
        effects="Effect sizes of ratings are means in points of the scale and in z, with 95 % intervals.",
    )


def _sentences(summary: RatingSummary, who: WhoAnswered) -> Iterator[str]:
    for of, rated in _COUNTED.items():
        raters = [rater for scale in summary.scales if scale.of == of for rater in scale.observers]
        if raters:
            count = counted(sum(rater.ratings for rater in raters), "rating")
            yield f"{who.words({rater.observer for rater in raters})}, {count}{rated}."


def _failed(summary: RatingSummary) -> Iterator[FailedCheck]:
    for scale in summary.scales:
        who = [observer.observer for observer in scale.observers if observer.flagged]
        if who:
            yield FailedCheck(
                f"Ratings of {some(who)} on the scale {scale.scale}{_CHECKED[scale.of]}",
                "Many of their ratings are far from the others' (rule of BT.500).",
                "Look at the session. Nobody is left out by this rule; to leave an observer out, give --without CODE.",
            )


def _task(summary: RatingSummary) -> Iterator[str]:
    """Yield what was rated after choices between two stimuli, and on what."""
    for of, what in _AFTER.items():
        scales = [scale.scale for scale in summary.scales if scale.of == of]
        if scales:
            on = f"the {'scale' if len(scales) == 1 else 'scales'} {listed(scales)}"
            yield f"After the choice between two, {what} rated on {on}."


def _analysis(summary: RatingSummary, cited: Citations) -> str:
    what = "Mean opinion scores" if any(scale.of == "alone" for scale in summary.scales) else "Mean ratings"
    if all(scale.ends for scale in summary.scales):
        how = (
            "that stay on the scale: Wilson's for shares, at the answers that would have the variance of the "
            f"observers' means with one more that differs by a point {cited.cite('Wilson1927')}"
        )
    else:
        how = f"by Student's t over the observers' means {cited.cite('ITU500')}"
    return f"{what} have 95 % intervals {how}."


def ratings_section(summary: RatingSummary, pictures: Mapping[str, str] = MappingProxyType({})) -> Section:
    """Return a figure with its table for each scale, and the ratings of each observer."""
    blocks: list[Figure | Table] = []
    for scale in summary.scales:
        blocks += [_scores(scale, pictures), _raters(scale)]
    return Section("ratings", "Ratings", tuple(blocks))


def _scores(scale: ScaleSummary, pictures: Mapping[str, str]) -> Figure:
    columns = (
        Column("Stimulus", "stimulus"),
        Column("Mean", "mean", "number", 2),
        Column("95 %", "mean", "interval", 2),
        Column("s.d.", "sd", "number", 2),
        Column("z", "z", "number", 2),
        Column("95 %", "z", "interval", 2),
        Column("Ratings", "ratings", "number"),
        Column("Observers", "observers", "number"),
    )
    rows = tuple(
        (
            score.stimulus,
            score.mean,
            score.interval or (None, None),
            score.sd,
            score.z,
            score.z_interval or (None, None),
            score.ratings,
            score.observers,
        )
        for score in scale.scores
    )
    title, _, more, end = _TITLES[scale.of]
    title, name = title.format(scale.scale), f"ratings_{scale.scale}{end}"
    dots = [(score.stimulus, score.mean, *(score.interval or (None, None))) for score in scale.scores]
    images = [draw_dots(dots, scale.scale, title, width) for width in (WIDE_IN, NARROW_IN)]
    caption = (
        f"{title}: means over the observers' means, with 95 % intervals {_INTERVALS[scale.ends is not None]}. z: in "
        f"standard deviations of each observer's own ratings, with intervals by Student's t.{more}"
    )
    return Figure(name, images[0], images[1], caption, Table(name, title, columns, rows, pictures=pictures))


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
        (
            observer.observer,
            observer.ratings,
            observer.mean,
            observer.sd,
            observer.above,
            observer.below,
            "flagged" if observer.flagged else None,
        )
        for observer in scale.observers
    )
    _, title, _, end = _TITLES[scale.of]
    title = f"{title.format(scale.scale)}; BT.500's rule is information, nobody is left out by it"
    return Table(f"raters_{scale.scale}{end}", title, columns, rows, folded=True)


def preferences_part(sessions: Sequence[SessionLog]) -> Part | None:
    """Return what a report says of choices between stereo and flat; None without any."""
    chosen = preferences(sessions)
    if not chosen.by_observer:
        return None
    return Part(
        key="preferences",
        result=chosen,
        sentences=(chosen.sentence,),
        sections=lambda _: (preferences_section(sessions, chosen),),
        conclusions=lambda: _conclusions(chosen),
        analysis=lambda cited: (
            "Shares for stereo have percentile intervals by bootstrap over observers, at levels widened for few "
            f"observers {cited.cite('Hesterberg2015')}; the sign test is over observers."
        ),
        draws=(draws_of_means(),),
        p_values=("The p value of the sign test over observers is two-sided and exact.",),
        effects="The effect size of stereo is its share of the choices, with a 95 % interval.",
    )


def _conclusions(chosen: Preferences) -> tuple[Conclusion, ...]:
    """Return whether one of stereo and flat is preferred, by the sign test over observers."""
    signs = np.sign([stereo - flat for stereo, flat in chosen.by_observer.values()])

    def test(signs: NDArray[np.int_]) -> Conclusion:
        decided = int(np.count_nonzero(signs))
        p = sign_test(int((signs > 0).sum()), decided) if decided else None
        return concluded("stereo over flat", p, None)

    share = share_for_stereo(chosen)
    found = replace(test(signs), estimate=share.value, low=share.low, high=share.high, unit="of the choices")
    return with_shares([found], [test(np.delete(signs, place)) for place in range(len(signs))])


def preferences_section(sessions: Sequence[SessionLog], chosen: Preferences) -> Section:
    """Return how often stereo was preferred: for each picture, in total, and by each observer."""
    people = list(chosen.by_observer)
    pictures = _pictures(sessions)
    total, count = np.zeros((len(people), len(pictures) + 1)), np.zeros((len(people), len(pictures) + 1))
    for session in sessions:
        for trial in session.of(PreferenceRecord):
            row = people.index(session.header.observer)
            for column in (pictures.index(_picture(trial)), len(pictures)):
                total[row, column] += trial.chosen_view == "stereo"
                count[row, column] += 1
    names = [*pictures, "all pictures"]
    estimates = [
        _unanimous(estimate, by_picture) if estimate.value in (0.0, 1.0) else estimate
        for estimate, by_picture in zip(means(total, count), count.T, strict=True)
    ]
    dots = [
        (name, estimate.value, estimate.low, estimate.high) for name, estimate in zip(names, estimates, strict=True)
    ]
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
            (name, stereo, of, estimate.value, (estimate.low, estimate.high))
            for name, estimate, stereo, of in zip(
                names, estimates, total.sum(axis=0).tolist(), count.sum(axis=0).tolist(), strict=True
            )
        ),
    )
    caption = (
        f"{title}, with 95 % intervals by bootstrap over observers, or Wilson's over the observers where all of them "
        "agree; dashed: no preference."
    )
    images = [draw_dots(dots, title.lower(), title, width, reference=0.5) for width in (WIDE_IN, NARROW_IN)]
    by_observer = Table(
        "preferences_by_observer",
        "By observer",
        (Column("Observer", "observer"), Column("Stereo", "stereo", "number"), Column("Flat", "flat", "number")),
        tuple((name, stereo, flat) for name, (stereo, flat) in chosen.by_observer.items()),
        folded=len(people) > 12,
    )
    figure = Figure("preferences", images[0], images[1], caption, table)
    return Section("preferences", "Stereo or flat", (Paragraph(_words(chosen)), figure, by_observer))


def share_for_stereo(chosen: Preferences) -> Estimated:
    """Return the share of the choices of all pictures for stereo, as the section has it."""
    counts = np.array(list(chosen.by_observer.values()), dtype=np.float64)
    (estimate,) = means(counts[:, :1], counts.sum(axis=1, keepdims=True))
    return _unanimous(estimate, counts.sum(axis=1)) if estimate.value in (0.0, 1.0) else estimate


def _unanimous(estimate: Estimated, count: Floats) -> Estimated:
    """Return the estimate with Wilson's interval over observers: bootstrap samples of unanimous answers do not vary."""
    people = int((count > 0).sum())
    low, high = wilson_interval(float(estimate.value or 0.0), people)
    return replace(estimate, low=max(low, 0.0), high=min(high, 1.0)) if people > 1 else estimate


def _words(chosen: Preferences) -> str:
    """Return the shares in words, with the sign test over observers."""
    decided = chosen.observers_for_stereo + chosen.observers_for_flat
    share = chosen.stereo / (chosen.stereo + chosen.flat)
    words = f"{chosen.sentence} Stereo has {percent(share, 1)} of the choices."
    if decided:
        p = sign_test(chosen.observers_for_stereo, decided)
        words += (
            f" Sign test over the {fixed(decided, 0)} observers with a preference: {p_words(p)} if neither version "
            "is preferred."
        )
    return words


def sign_test(count: int, of: int) -> float:
    """Return the two-sided p value of the sign test, ``count`` of ``of`` observers being for one side."""
    from scipy.special import bdtr

    return min(1.0, 2 * float(bdtr(min(count, of - count), of, 0.5)))


def _pictures(sessions: Sequence[SessionLog]) -> list[str]:
    """Return the names of the pictures, in the header's order."""
    place = {name: number for number, name in enumerate(sessions[0].header.stimulus_names)}
    named = {
        _picture(trial): place.get(trial.first, len(place))
        for session in sessions
        for trial in session.of(PreferenceRecord)
    }
    return sorted(named, key=lambda name: (named[name], name))


def _picture(trial: PreferenceRecord) -> str:
    """Return the common beginning of the names of both versions, or both names, stereo first."""
    both = [trial.first, trial.second]
    if trial.first_view == "flat":
        both.reverse()
    shared = both[0].removesuffix("stereo")
    if shared != both[0] and shared == both[1].removesuffix("flat"):
        return shared.rstrip(" -_") or " / ".join(both)
    return " / ".join(both)
