"""The results in sentences, for the terminal and the page."""

from __future__ import annotations

from analysis.agreement.comparison import VERDICT_BY
from analysis.agreement.limits import LimitCheck, Proportion
from analysis.agreement.pairs import PairAccuracy
from analysis.agreement.result import Agreement, Correlation, MeasureResult
from analysis.report.words import fixed, p_words, percent
from documents import counted


def verdict(result: MeasureResult, agreement: Agreement) -> str:
    """Return whether a measure agrees with observers, in a sentence."""
    title = result.predicted.title
    found = result.whole.correlations[VERDICT_BY]
    if result.adjusted_p is None or found.value is None:
        return f"{title}: it cannot be said, since the measure or the scores are the same for all stimuli of a group."
    rho = f"Spearman's ρ = {fixed(found.value, 2)}{ends(found)}"
    many = f" after Holm's correction for {len(agreement.measures)} measures" if len(agreement.measures) > 1 else ""
    tested = f"{p_words(result.adjusted_p)}{many}"
    if result.decision == "agrees":
        return f"{title} agrees with observers: {rho}, {tested}."
    if result.decision == "cannot be said":
        return (
            f"{title}: it cannot be said, since with so few stimuli even perfect agreement could be luck "
            f"(p at least {agreement.least_p:.2g}{' times the number of measures' if many else ''}); {rho}."
        )
    return f"{title}: no agreement is shown. {rho}, {tested}. That is no proof that there is none."


def ends(found: Correlation) -> str:
    """Return an interval in brackets, or nothing."""
    if found.low is None or found.high is None:
        return ""
    return f" ({fixed(found.low, 2)} to {fixed(found.high, 2)})"


def pairs_words(accuracy: PairAccuracy) -> str:
    """Return the accuracy on pairs in a sentence."""
    if accuracy.share is None:
        return "No pair is distinguished by observers."
    pairs = counted(accuracy.of, "pair", "pairs")
    words = (
        f"Of {pairs} that observers distinguish, it puts {accuracy.right:g} in their order ({percent(accuracy.share)}"
    )
    if accuracy.low is not None and accuracy.high is not None:
        low, high = fixed(100 * accuracy.low, 0), fixed(100 * accuracy.high, 0)
        words += f"; {low} to {high} % with other observers" if low != high else "; the same in the draws of observers"
    return words + ")."


def limit_words(calibration: LimitCheck, unit: str, *, higher: bool) -> tuple[str, ...]:
    """Return what a limit is worth, in sentences."""
    same, stimuli = calibration.same, calibration.stimuli
    of = counted(stimuli, "stimulus", "stimuli")
    sentences = [f"Of {of}, {same} {'is' if same == 1 else 'are'} not distinguished from the photograph by observers."]
    table = calibration.table
    if table is not None:
        sentences.append(
            f"Within the limit of {value(table.limit, unit)} are {_of(table.hit_rate, 'in its class')} and "
            f"{_of(table.false_alarm_rate, 'in others')}: it says what observers say of {table.right.times} of "
            f"{table.right.of}."
        )
    if calibration.area is None or calibration.best is None or calibration.best_table is None:
        sentences.append("All are of one sort, so that no limit can be told from another.")
        return tuple(sentences)
    area = f"Area under the curve {fixed(calibration.area, 2)}"
    if calibration.area_low is not None and calibration.area_high is not None:
        area += f" ({fixed(calibration.area_low, 2)} to {fixed(calibration.area_high, 2)})"
    best = calibration.best_table
    agrees = f"the limit that agrees best is {value(calibration.best, unit)}"
    if calibration.best_low is not None and calibration.best_high is not None:
        agrees += f" ({value(calibration.best_low)} to {value(calibration.best_high, unit)} with other observers)"
    side = "at or above it" if higher else "at or below it"
    hits, alarms = _of(best.hit_rate, "in its class"), _of(best.false_alarm_rate, "in others")
    sentences.append(f"{area}; {agrees}: {side} are {hits} and {alarms}.")
    return tuple(sentences)


def value(number: float, unit: str = "") -> str:
    """Return a value of a measure with its unit."""
    text = "∞" if number == float("inf") else f"{number:.3g}".replace("-", "−")
    return f"{text} {unit}".rstrip()


def _of(rate: Proportion, which: str) -> str:
    if rate.share is None or rate.low is None or rate.high is None:
        return f"none {which}, since there is none"
    low, high = fixed(100 * rate.low, 0), fixed(100 * rate.high, 0)
    return f"{rate.times} of the {rate.of} {which} ({low} to {high} %)"


def group_name(name: str) -> str:
    """Return a group's name; that of the only one is empty."""
    return name or "all stimuli"


def asked(agreement: Agreement) -> str:
    """Return what was asked, in a sentence."""
    groups = agreement.groups
    people = sorted({group.observers for group in groups})
    who = f"{people[0]}" if len(people) == 1 else f"{people[0]} to {people[-1]}"
    stimuli = sum(
        len(group.stimuli) - (photograph in group.stimuli)
        for group, photograph in zip(groups, agreement.photographs, strict=True)
    )
    where = f" in {len(groups)} groups" if len(groups) > 1 else ""
    observers = "observer" if who == "1" else "observers"
    return (
        f"Do measures of the difference from the photograph order {stimuli} stimuli{where} as {who} {observers} did, "
        f"by {groups[0].task}?"
    )
