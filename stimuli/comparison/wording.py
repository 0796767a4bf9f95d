"""A comparison in words: the verdict in a sentence, failures line by line, and a few lines on what passes."""

from __future__ import annotations

from collections.abc import Sequence

from stimuli.comparison.results import Comparison
from stimuli.comparison.verdict import Outcome, Reason, Verdict, decimals

# Up to this many regions that fail are listed one by one.
MOST_REGIONS = 3
# As `together` begins the reasons of either eye.
_EYES = ("left eye: ", "right eye: ")


def decision_sentence(verdict: Verdict) -> str:
    """Return the verdict in a sentence or two."""
    fails, undecided = len(verdict.having("fails")), len(verdict.having("cannot say"))
    if verdict.decision == "validated":
        return "Validated: within the limits, the rendering is the photograph."
    if verdict.decision == "not validated":
        return f"Not validated: {fails} {'limit is' if fails == 1 else 'limits are'} not kept."
    return f"Undecided: {undecided} {'thing is' if undecided == 1 else 'things are'} not known well enough."


def outcome_lines(verdict: Verdict, outcome: Outcome) -> list[str]:
    """Return the sentences of one outcome; what is the same for both eyes appears once, many regions in one line."""
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
    """Return a line for each subject that passes: its numbers, of both eyes if there are two, and limits."""
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
    """Return the heading of the lines of `passing_lines`."""
    pair = any(reason.subject.startswith(_EYES) for reason in verdict.reasons)
    return "Within their limits" + (", left eye / right eye" if pair else "") + ":"


def _split(text: str) -> tuple[str, str]:
    return next(((eye, text.removeprefix(eye)) for eye in _EYES if text.startswith(eye)), ("", text))


def _numbers(measure: str, reasons: Sequence[Reason]) -> str:
    first = reasons[0]
    unit = f" {first.unit}" if first.unit else ""
    values = " / ".join(_number(reason) for reason in reasons)
    return f"{measure} {values}{unit}" + ("" if first.limit is None else f" (limit {first.limit:g}{unit})")


def _number(reason: Reason) -> str:
    value = 0.0 if reason.value is None else reason.value
    return decimals(value, 2) if "ΔE00" in reason.measure or reason.unit == "px" else f"{abs(value):.2g}"


def summary(comparison: Comparison) -> list[str]:
    """Return the lines that a terminal shows: the verdict, its reasons with a mark each, what passes, and remarks."""
    verdict = comparison.verdict
    lines = [decision_sentence(verdict)]
    marks: tuple[tuple[Outcome, str], ...] = (("fails", "✗"), ("cannot say", "?"), ("noted", "·"))
    lines += [f"  {mark} {line}" for outcome, mark in marks for line in outcome_lines(verdict, outcome)]
    passing = passing_lines(verdict)
    if passing:
        lines += [passing_heading(verdict), *(f"  ✓ {line}" for line in passing)]
    remarks: dict[str, list[str]] = {}
    for eye, result in comparison.eyes.items():
        for remark in result.notes:
            remarks.setdefault(remark, []).append("" if eye == "both" else f"{eye} eye: ")
    lines += [f"Note: {eyes[0] if len(eyes) == 1 else ''}{remark}." for remark, eyes in remarks.items()]
    for picture in (comparison.photo, comparison.rendering):
        lines += [f"Note: {picture.file}: {remark}." for remark in picture.notes]
    return lines
