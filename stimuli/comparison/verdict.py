"""A verdict: the limits that a rendering must keep, every reason for the decision, and both in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, model_validator

from documents.text import JsonResult, significant
from documents.yaml import FileModel, Positive

Outcome = Literal["passes", "fails", "cannot say", "noted"]
Decision = Literal["validated", "not validated", "cannot say"]

# Up to this many regions that fail are listed one by one.
MOST_REGIONS = 3
# Below it a number that passes is printed as 0.00.
_NEXT_TO_NOTHING = 1e-4
# As `together` begins the reasons of either eye.
_EYES = ("left eye: ", "right eye: ")


class Limits(FileModel):
    """The limits of a verdict.

    Two colours count as equal up to ``delta_e``: 1.0 ± 0.4 of Berns and Hou for car paint, thesis Section 5.5. Of the
    pixels ``above_limit_percent`` may differ by more, as the eye resolves them. Pictures that lie further apart than
    ``registration_residual_px`` are not compared pixel by pixel. Sparkle differs if it does by more than
    ``sparkle_relative`` and by more than ``sparkle_z`` standard errors; where these are larger than
    ``sparkle_relative_se``, the verdict is open. A region that departs from the others by more than ``stands_out_...``
    is named.
    """

    delta_e: Positive = 1.4
    """The ΔE00 that a region may have."""
    above_limit_percent: Annotated[float, Field(gt=0, le=100)] = 5.0
    """The share of a region's pixels that may be above the limit, in percent."""
    registration_residual_px: Positive = 0.25
    """How far the pictures may be from lying on each other, in pixels."""
    sparkle_relative: Positive = 0.10
    """By how much sparkle measures may differ, as a share."""
    sparkle_z: Positive = 2.58
    """By how many standard errors sparkle measures may differ."""
    sparkle_relative_se: Positive = 0.25
    """The largest standard error of a sparkle measure, as a share."""
    disparity_px: Positive = 0.5
    """By how much disparities may differ, in pixels."""
    depth_scale: Positive = 0.1
    """By how much the rendering may be deeper or shallower, as a share."""
    eye_roll_deg: Positive = 0.2
    """How far one view may be turned against the other, in degrees."""
    eye_luminance: Positive = 0.1
    """By how much the ratio of both eyes' luminances may differ, as a share."""
    eye_contrast: Positive = 0.2
    """By how much the ratio of both eyes' contrasts may differ, as a share."""
    eye_agreement: Positive = 0.1
    """By how much the correlations of the two views may differ."""
    one_eyed_share: Positive = 0.1
    """By how much the shares of sparkles that one eye alone sees may differ."""
    stands_out_delta_xy: Positive = 0.001
    """How far in x, y a sparkle's colour stands out."""
    stands_out_luminance: Positive = 0.01
    """By how much a sparkle's luminance stands out."""
    stands_out_z: Positive = 3.0
    """By how many standard deviations a sparkle stands out."""

    @model_validator(mode="before")
    @classmethod
    def _left_out(cls, given: Any) -> Any:
        """Take a key without a value for one that is left out."""
        return {key: value for key, value in given.items() if value is not None} if isinstance(given, dict) else given


@dataclass(frozen=True, slots=True)
class Reason(JsonResult):
    """One thing that was judged: ``value`` against ``limit`` (None where there is none), and a ``sentence`` on it."""

    subject: str
    measure: str
    outcome: Outcome
    sentence: str
    value: float | None = None
    limit: float | None = None
    unit: str = ""
    json_keys: ClassVar = {"sentence": "said"}


def decimals(value: float, count: int) -> str:
    """Return a number with ``count`` decimals; zero has no sign."""
    text = f"{value:.{count}f}"
    return text.lstrip("-") if float(text) == 0 else text


@dataclass(frozen=True, slots=True)
class Verdict(JsonResult):
    """``decision`` with every reason, failures first."""

    decision: Decision
    reasons: tuple[Reason, ...]
    limits: Limits

    def having(self, outcome: Outcome) -> tuple[Reason, ...]:
        """Return the reasons of one outcome."""
        return tuple(reason for reason in self.reasons if reason.outcome == outcome)


def together(verdicts: Mapping[str, Verdict]) -> Verdict:
    """Return the verdict on several pairs, such as both eyes', by name: one that is not validated decides.

    Raises
    ------
    ValueError
        If there is none.
    """
    if not verdicts:
        raise ValueError("no verdicts")
    reasons = [
        replace(reason, subject=f"{name}: {reason.subject}", sentence=f"{name}: {reason.sentence}")
        for name, verdict in verdicts.items()
        for reason in verdict.reasons
    ]
    return decided(reasons, next(iter(verdicts.values())).limits)


def decided(reasons: list[Reason], limits: Limits) -> Verdict:
    """Return the verdict that follows from the reasons: one failure is enough for "not validated"."""
    order: tuple[Outcome, ...] = ("fails", "cannot say", "noted", "passes")
    ordered = tuple(sorted(reasons, key=lambda reason: order.index(reason.outcome)))
    outcomes = {reason.outcome for reason in reasons}
    decision: Decision = "validated"
    if "fails" in outcomes:
        decision = "not validated"
    elif "cannot say" in outcomes or "passes" not in outcomes:
        decision = "cannot say"
    return Verdict(decision, ordered, limits)


def decision_sentence(verdict: Verdict) -> str:
    """Return the verdict in a sentence or two.

    Parameters
    ----------
    verdict
        The verdict on one pair of pictures, or on both eyes'.

    Returns
    -------
    str
        The decision, with the number of limits that are not kept or of things that are not known.

    Examples
    --------
    >>> hood = Reason("region 'hood'", "ΔE00", "fails", "'hood' differs by ΔE00 2.10", 2.1, 1.4)
    >>> decision_sentence(decided([hood], Limits()))
    'Not validated: 1 limit is not kept.'
    """
    fails, undecided = len(verdict.having("fails")), len(verdict.having("cannot say"))
    if verdict.decision == "validated":
        return "Validated: within the limits, the rendering is the photograph."
    if verdict.decision == "not validated":
        return f"Not validated: {fails} {'limit is' if fails == 1 else 'limits are'} not kept."
    return f"Undecided: {undecided} {'thing is' if undecided == 1 else 'things are'} not known well enough."


def outcome_lines(verdict: Verdict, outcome: Outcome) -> list[str]:
    """Return the sentences of one outcome; what is the same for both eyes appears once, many regions in one line.

    Parameters
    ----------
    verdict
        The verdict on one pair of pictures, or on both eyes'.
    outcome
        ``passes``, ``fails``, ``cannot say`` or ``noted``.

    Returns
    -------
    list[str]
        The sentences, without a full stop; empty if no reason has this outcome.

    Examples
    --------
    >>> hood = Reason("region 'hood'", "ΔE00", "fails", "'hood' differs by ΔE00 2.10", 2.1, 1.4)
    >>> verdict = decided([hood], Limits())
    >>> outcome_lines(verdict, "fails"), outcome_lines(verdict, "noted")
    (["'hood' differs by ΔE00 2.10"], [])
    """
    lines = (
        _gathered(verdict.having(outcome))
        if outcome == "fails"
        else [reason.sentence for reason in verdict.having(outcome)]
    )
    shown: dict[str, None] = {}
    for line in lines:
        eye, text = _split(line)
        alike = eye and all(f"{reason}{text}" in lines for reason in _EYES)
        shown[f"both eyes: {text}" if alike else line] = None
    return list(shown)


def _gathered(reasons: Sequence[Reason]) -> list[str]:
    """Return the sentences, those on more regions than `MOST_REGIONS` of one eye in one; the worst are named."""
    regions: dict[str, list[Reason]] = {}
    for reason in reasons:
        eye, subject = _split(reason.subject)
        if subject.startswith("region ") and reason.measure == "ΔE00":
            regions.setdefault(eye, []).append(reason)
    lines: dict[str, None] = {}
    for reason in reasons:
        eye, _ = _split(reason.subject)
        group = regions.get(eye, [])
        if len(group) <= MOST_REGIONS or reason not in group:
            lines[reason.sentence] = None
            continue
        worst = sorted(group, key=lambda bad: -(bad.value or 0.0))[:MOST_REGIONS]
        names = ", ".join(f"'{_split(bad.subject)[1].removeprefix('region ')}' by {bad.value:.2f}" for bad in worst)
        limit = f"{reason.limit:g}" if reason.limit is not None else "allowed"
        lines[f"{eye}{len(group)} regions differ by more than ΔE00 {limit}, most of all {names}"] = None
    return list(lines)


def passing_lines(verdict: Verdict) -> list[str]:
    """Return a line for each subject that passes: its numbers, of both eyes if there are two, and limits.

    Parameters
    ----------
    verdict
        The verdict on one pair of pictures, or on both eyes'.

    Returns
    -------
    list[str]
        A line for each subject; empty if none passes.

    Examples
    --------
    >>> door = Reason("region 'door'", "ΔE00", "passes", "'door' differs by ΔE00 0.80", 0.8, 1.4)
    >>> passing_lines(decided([door], Limits()))
    ["region 'door': ΔE00 0.80 (limit 1.4)"]
    """
    subjects: dict[str, dict[str, list[Reason]]] = {}
    for reason in verdict.having("passes"):
        eye, subject = _split(reason.subject)
        # Where one eye alone passes, its number must not be taken for both eyes'.
        other_eye = next((name for name in _EYES if name != eye), "")
        alone = eye and not any(
            each.subject == f"{other_eye}{subject}" and each.measure == reason.measure
            for each in verdict.having("passes")
        )
        subjects.setdefault(reason.subject if alone else subject, {}).setdefault(reason.measure, []).append(reason)
    return [
        f"{subject}: " + ", ".join(_numbers(measure, reasons) for measure, reasons in measures.items())
        for subject, measures in subjects.items()
    ]


def passing_heading(verdict: Verdict) -> str:
    """Return the heading of the lines of `passing_lines`.

    Parameters
    ----------
    verdict
        The verdict on one pair of pictures, or on both eyes'.

    Returns
    -------
    str
        The heading; it names the order of the eyes where numbers of both are given.

    Examples
    --------
    >>> door = Reason("region 'door'", "ΔE00", "passes", "'door' differs by ΔE00 0.80", 0.8, 1.4)
    >>> verdict = decided([door], Limits())
    >>> passing_heading(verdict)
    'Within their limits:'
    >>> passing_heading(together({"left eye": verdict, "right eye": verdict}))
    'Within their limits, left eye / right eye:'
    """
    pair = any(reason.subject.startswith(_EYES) for reason in verdict.reasons)
    return "Within their limits" + (", left eye / right eye" if pair else "") + ":"


def _split(text: str) -> tuple[str, str]:
    return next(((eye, text.removeprefix(eye)) for eye in _EYES if text.startswith(eye)), ("", text))


def _numbers(measure: str, reasons: Sequence[Reason]) -> str:
    first = reasons[0]
    unit = first.unit if first.unit in ("", "°") else f" {first.unit}"
    values = " / ".join(_number(reason) for reason in reasons)
    return f"{measure} {values}{unit}" + ("" if first.limit is None else f" (limit {first.limit:g}{unit})")


def _number(reason: Reason) -> str:
    value = 0.0 if reason.value is None else reason.value
    return (
        decimals(value, 2)
        if "ΔE00" in reason.measure or reason.unit == "px" or abs(value) < _NEXT_TO_NOTHING
        else significant(abs(value), 2)
    )
