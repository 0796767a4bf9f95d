"""The reasons that two eyes give: whether a rendering for two eyes is seen as its photograph is.

A measure fails if it lies beyond its limit by three standard errors. It is left open if it is beyond the limit by
fewer, or known less well than to the limit. Faults with a name, exchanged eyes and flat views, come first, and what
follows from them is not named again.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from documents.text import significant, with_error
from stimuli.comparison.disparities import LEAST_SQUARES, EyesPair
from stimuli.comparison.eye_identity import EyeIdentity
from stimuli.comparison.verdict import Limits, Outcome, Reason

_Z = 3.0
# With another scale of depth than this, views are no copies of each other, and with less than the last it is inverted.
_FLAT_SCALE, _INVERTED_SCALE = 0.5, -0.5
# Less is no depth.
_NO_SCALE = 0.2
# An eye agrees with the photograph's, and the other by less than this share of it: it shows something else.
_AGREES, _ELSEWHERE_SHARE = 0.4, 0.5

_Judge = Callable[[EyesPair, Limits], Reason]


@dataclass(frozen=True, eq=False, slots=True)
class BinocularEvidence:
    """What two eyes see: ``measures`` by name, which eye shows which view, and how many squares have a disparity.

    ``same_views`` is true if both views of the rendering are the same and the photograph's are not.
    """

    measures: Mapping[str, EyesPair] = field(default_factory=dict)
    identity: EyeIdentity | None = None
    squares: tuple[int, int] = (0, 0)
    same_views: bool = False


def binocular_reasons(evidence: BinocularEvidence | None, limits: Limits) -> list[Reason]:
    """Return whether both eyes see the rendering as they see the photograph, and faults by their name."""
    if evidence is None:
        return []
    named = [*_exchanged(evidence), *_flat(evidence)]
    judged = {name: _JUDGED[name](pair, limits) for name, pair in evidence.measures.items() if name in _JUDGED}
    flat = any(reason.measure == "flat" for reason in named)
    depth = judged.get("depth scale")
    other_depth = flat or (depth is not None and depth.outcome == "fails")
    if flat:
        judged.pop("depth scale", None)
    one_eyed = judged.get("one-eyed share")
    follows = {
        "disparity across": other_depth,
        "disparity down": other_depth,
        "disparity left": other_depth,
        "roll": flat,
        "sparkle depth": other_depth or (one_eyed is not None and one_eyed.outcome == "fails"),
    }
    reasons = [one for name, one in judged.items() if not (follows.get(name, False) and one.outcome == "cannot say")]
    return [*named, *_elsewhere(evidence, judged), *reasons, *_unknown(evidence)]


def _exchanged(evidence: BinocularEvidence) -> list[Reason]:
    found = evidence.identity
    if found is None or found.way != "exchanged":
        return []
    sentence = (
        "the rendering's eyes are exchanged: each shows the photograph's other view (correlation "
        f"{found.agreement:.2f}, with its own {found.agreement_own:.2f}); they were changed back for all else"
    )
    return [Reason("eyes", "exchanged", "fails", sentence, found.agreement - found.agreement_own)]


def _flat(evidence: BinocularEvidence) -> list[Reason]:
    found, scale = evidence.identity, evidence.measures.get("depth scale")
    twice = found is not None and found.way in ("left twice", "right twice")
    if twice and scale is not None and abs(scale.rendering) > _FLAT_SCALE:
        twice = False
    shallow = scale is not None and abs(scale.rendering) + _Z * scale.standard_error < _NO_SCALE
    if not (twice or shallow or evidence.same_views):
        return []
    which = f"the {found.way.removesuffix(' twice')} view" if found is not None and found.way and twice else "one view"
    sentence = f"the rendering is flat: both eyes of the rendering show {which}, and the photograph's two views differ"
    value = None if found is None else found.agreement - found.agreement_own
    return [Reason("eyes", "flat", "fails", sentence, value)]


def _elsewhere(evidence: BinocularEvidence, judged: Mapping[str, Reason]) -> list[Reason]:
    """Return a reason if one eye of the rendering shows something else than the photograph, and the other does not."""
    found = evidence.identity
    apart = any(name in judged and judged[name].outcome == "fails" for name in ("eye agreement", "one-eyed share"))
    if found is None or found.way not in ("own", "exchanged") or not apart:
        return []
    good, bad = max(found.left, found.right), min(found.left, found.right)
    if good < _AGREES or bad > _ELSEWHERE_SHARE * good:
        return []
    eye, other = ("left", "right") if found.left < found.right else ("right", "left")
    sentence = (
        f"the rendering's {eye} eye has its sparkles or texture elsewhere than the photograph (correlation {bad:.2f}), "
        f"and its {other} eye has not ({good:.2f})"
    )
    return [Reason("eyes", "one eye alone", "fails", sentence, bad)]


def _unknown(evidence: BinocularEvidence) -> list[Reason]:
    """Return a reason on depth that could not be compared."""
    if "disparity across" in evidence.measures:
        return []
    photo, rendering = evidence.squares
    if max(photo, rendering) < LEAST_SQUARES:
        sentence = "neither picture has enough texture to measure its depth"
        return [Reason("disparity", "known", "noted", sentence)]
    sentence = (
        f"depth cannot be compared: {photo} squares of the photograph have a disparity and {rendering} of the rendering"
    )
    return [Reason("disparity", "known", "cannot say", sentence)]


def _outcome(apart: float, error: float, most: float) -> Outcome:
    """Return what a difference and its standard error say on a limit."""
    if math.isnan(apart) or math.isnan(error):
        return "cannot say"
    if abs(apart) > most:
        return "fails" if abs(apart) - _Z * error > most else "cannot say"
    return "passes" if error <= most else "cannot say"


_HOW: dict[Outcome, str] = {"passes": "within", "fails": "more than", "cannot say": "too uncertain against"}


def _reason(
    subject: str, measure: str, apart: float, error: float, most: float, sentence: str, unit: str = "px"
) -> Reason:
    if math.isnan(apart) or math.isnan(error):
        return Reason(
            subject, measure, "cannot say", f"{measure} of the {subject} is known of one picture only", None, most, unit
        )
    outcome = _outcome(apart, error, most)
    times = 100.0 if unit == "%" else 1.0
    tail = f"{_HOW[outcome]} {times * most:g}{'' if unit == '°' else ' ' if unit else ''}{unit}"
    return Reason(subject, measure, outcome, f"{sentence}, {tail}", times * apart, times * most, unit)


def _disparity(axis: str) -> _Judge:
    def judged(pair: EyesPair, limits: Limits) -> Reason:
        sentence = f"disparity {axis} differs by {with_error(pair.difference, pair.standard_error)} px"
        return _reason("disparity", axis, pair.difference, pair.standard_error, limits.disparity_px, sentence)

    return judged


def _left(pair: EyesPair, limits: Limits) -> Reason:
    sentence = f"disparities differ from place to place by {with_error(pair.difference, pair.standard_error)} px"
    return _reason("disparity", "by place", pair.difference, pair.standard_error, limits.disparity_px, sentence)


def _scale(pair: EyesPair, limits: Limits) -> Reason:
    times, most = with_error(pair.rendering, pair.standard_error), 100 * limits.depth_scale
    outcome = _outcome(pair.difference, pair.standard_error, limits.depth_scale)
    if pair.rendering + _Z * pair.standard_error < _INVERTED_SCALE:
        sentence = f"depth is inverted: what lies in front lies behind, {times} times as far"
    else:
        how = {"passes": "within {} %", "fails": "more than {} % off", "cannot say": "too uncertain against {} %"}
        sentence = f"depth is {times} times the photograph's, {how[outcome].format(f'{most:g}')}"
    return Reason("depth", "scale", outcome, sentence, 100 * pair.difference, most, "%")


def _roll(pair: EyesPair, limits: Limits) -> Reason:
    way = "clockwise" if pair.difference >= 0 else "anticlockwise"
    sentence = (
        f"the rendering's right view is turned by {with_error(abs(pair.difference), pair.standard_error)}° {way} "
        "against its left, beyond the photograph's"
    )
    return _reason(
        "right eye beside left", "roll", pair.difference, pair.standard_error, limits.eye_roll_deg, sentence, "°"
    )


def _times(ratio: float) -> str:
    return f"{ratio:.2f}" if 0.1 <= ratio < 100 else significant(ratio)


def _ratio(measure: str) -> _Judge:
    """Judge a logarithm of right over left as a ratio."""

    def judged(pair: EyesPair, limits: Limits) -> Reason:
        most = limits.eye_contrast if measure == "contrast" else limits.eye_luminance
        apart = math.expm1(abs(pair.difference))
        error = math.exp(abs(pair.difference)) * pair.standard_error
        rendering, photo = (_times(math.exp(value)) for value in (pair.rendering, pair.photo))
        sentence = (
            f"the right eye has {rendering} times the left eye's {measure} in the rendering and {photo} times in the "
            f"photograph, {with_error(100 * apart, 100 * error)} % apart"
        )
        return _reason("right eye beside left", measure, apart, error, most, sentence, "%")

    return judged


def _agreement(pair: EyesPair, limits: Limits) -> Reason:
    sentence = (
        f"the two views correlate by {pair.rendering:.2f} in the rendering and by {pair.photo:.2f} in the photograph, "
        f"{with_error(abs(pair.difference), pair.standard_error)} apart"
    )
    return _reason(
        "right eye beside left", "agreement", pair.difference, pair.standard_error, limits.eye_agreement, sentence, ""
    )


def _one_eyed(pair: EyesPair, limits: Limits) -> Reason:
    rendering, photo = (significant(100 * value) for value in (pair.rendering, pair.photo))
    sentence = (
        f"one eye alone sees {rendering} % of the rendering's sparkles and {photo} % of the photograph's, "
        f"{with_error(100 * abs(pair.difference), 100 * pair.standard_error)} % apart"
    )
    return _reason(
        "sparkles", "one eye only", pair.difference, pair.standard_error, limits.one_eyed_share, sentence, "%"
    )


def _sparkle_depth(pair: EyesPair, limits: Limits) -> Reason:
    sentence = (
        "the mean disparity of sparkles from their surface, of those that both eyes see, differs by "
        f"{with_error(pair.difference, pair.standard_error)} px"
    )
    return _reason("sparkles", "disparity", pair.difference, pair.standard_error, limits.disparity_px, sentence)


_JUDGED: dict[str, _Judge] = {
    "disparity across": _disparity("across"),
    "disparity down": _disparity("down"),
    "depth scale": _scale,
    "disparity left": _left,
    "roll": _roll,
    "eye luminance": _ratio("luminance"),
    "eye contrast": _ratio("contrast"),
    "eye agreement": _agreement,
    "one-eyed share": _one_eyed,
    "sparkle depth": _sparkle_depth,
}
