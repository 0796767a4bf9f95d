"""The thresholds that blocks of the kind ``threshold`` measured: a fit for each observer, and means over observers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Literal

from analysis.errors import ResultsError
from analysis.records import SessionLog, WhoAnswered, in_time, refuse_mixtures, who_answered
from analysis.series import Estimated
from documents import Finding
from documents.text import JsonResult
from extensions.thresholds.fit import Easier, ThresholdFit, axis_of, axis_warning, fit_threshold, mean_parameter
from extensions.thresholds.record import ThresholdRecord

GUESSES: Mapping[str, float | None] = {"yes_no": None, "two_intervals": 0.5, "two_places": 0.5}


@dataclass(frozen=True, slots=True)
class Question:
    """What a threshold is of: a factor of the stimuli, in a group such as a scene if there are groups, by a task."""

    factor: str
    task: str
    function: str
    easier: Easier
    group_factor: str | None = None
    group: str | None = None

    @property
    def name(self) -> str:
        """In words, such as "contrast, scene beach"."""
        return self.factor if self.group is None else f"{self.factor}, {self.group_factor} {self.group}"


@dataclass(frozen=True, slots=True)
class ObserverThreshold(JsonResult):
    """One observer's fit."""

    observer: str
    fit: ThresholdFit
    json_keys: ClassVar = {"fit": "*"}


@dataclass(frozen=True, slots=True)
class QuestionSummary(JsonResult):
    """The thresholds of one question: each observer's, sorted, and the means over those who have one.

    Means of thresholds on a logarithmic axis and of slopes are those of logarithms; 95 % intervals are by bootstrap
    over observers. ``warning`` says what a level of 0 did to the axis; it is empty where there is none.
    """

    question: Question
    observers: tuple[ObserverThreshold, ...]
    threshold: Estimated
    slope: Estimated
    guess: Estimated
    lapse: Estimated
    warning: str = ""
    json_keys: ClassVar = {"question": "*"}
    json_names: ClassVar = "question question.name over_observers warning observers"

    @property
    def trials(self) -> int:
        """How many trials there were, those without a signal among them."""
        return sum(sum(each.fit.trials) + each.fit.blanks[1] for each in self.observers)

    @property
    def over_observers(self) -> dict[str, Estimated]:
        """The means over observers by name."""
        return {name: getattr(self, name) for name in ("threshold", "slope", "guess", "lapse")}


@dataclass(frozen=True, slots=True)
class ThresholdSummary:
    """The results of blocks of the kind ``threshold``, by question in the order of the records."""

    experiment: str
    questions: tuple[QuestionSummary, ...]
    who: WhoAnswered

    @property
    def sentence(self) -> str:
        """The numbers of observers and trials, and of thresholds that could not be estimated."""
        people = {each.observer for question in self.questions for each in question.observers}
        trials = sum(question.trials for question in self.questions)
        sought = [each.fit for question in self.questions for each in question.observers]
        missing = sum(fit.threshold is None for fit in sought)
        words = f"{self.who.words(people)}, {trials:,} trials at thresholds"
        return f"{words}; {missing} of {len(sought)} thresholds cannot be estimated." if missing else f"{words}."

    @property
    def notes(self) -> tuple[str, ...]:
        """What a level of 0 did to the axes, and how a block avoids it, in sentences."""
        remedy = "In a block, name the stimulus without a signal as 'reference': it then has no level."
        warned = [each for each in self.questions if each.warning]
        return tuple(f"Threshold of {each.question.name}: {each.warning}. {remedy}" for each in warned)


def summarise_thresholds(sessions: Sequence[SessionLog]) -> ThresholdSummary:
    """Fit the thresholds of one experiment's sessions, by each trial's last attempt.

    Parameters
    ----------
    sessions
        Sessions of one experiment.

    Returns
    -------
    ThresholdSummary
        For each factor, group and task a fit for each observer; without numbers, and with a reason, where answers tell
        no threshold.

    Raises
    ------
    ResultsError
        If the sessions cannot be analysed together, or have no such trial.
    """
    refuse_mixtures(sessions)
    asked: dict[Question, dict[str, list[ThresholdRecord]]] = {}
    for session in in_time(sessions):
        for trial in session.of(ThresholdRecord):
            people = asked.setdefault(_question(trial), {})
            people.setdefault(session.header.observer, []).append(trial)
    if not asked:
        files = ", ".join(str(session.file) for session in sessions[:3])
        what = "the results hold no trial of a threshold"
        raise ResultsError(Finding(what, files, remedy="answer some trials first"))
    fitted = tuple(_fitted(*each) for each in asked.items())
    return ThresholdSummary(sessions[0].header.experiment, fitted, who_answered(sessions))


def _fitted(question: Question, people: Mapping[str, Sequence[ThresholdRecord]]) -> QuestionSummary:
    shown = [(each.level, each.is_right) for own in people.values() for each in own if each.level is not None]
    levels = [level for level, _ in shown]
    axis = axis_of(levels or [1.0])  # one for all observers, so that there is a mean
    warning = axis_warning(levels, [right for _, right in shown]) if shown else ""
    fits = tuple(ObserverThreshold(name, _fit(question, people[name], axis)) for name in sorted(people))
    each = [observer.fit for observer in fits]
    names: tuple[Literal["threshold", "slope", "guess", "lapse"], ...] = ("threshold", "slope", "guess", "lapse")
    threshold, slope, guess, lapse = (mean_parameter(each, name) for name in names)
    given = GUESSES[question.task]
    if given is not None and guess.value is not None:
        guess = replace(guess, value=given, low=None, high=None)
    return QuestionSummary(question, fits, threshold, slope, guess, lapse, warning)


def _fit(question: Question, trials: Sequence[ThresholdRecord], axis: str) -> ThresholdFit:
    shown = [(trial.level, trial.is_right) for trial in trials if trial.level is not None]
    blanks = sum(trial.level is None and trial.answer == "yes" for trial in trials), len(trials) - len(shown)
    if not shown:
        reason = "no stimulus with a signal was shown"
        return ThresholdFit(question.function, axis, (), (), (), easier=question.easier, blanks=blanks, reason=reason)
    return fit_threshold(
        [level for level, _ in shown],
        [right for _, right in shown],
        guess=GUESSES[question.task],
        function=question.function,
        axis=axis,
        easier=question.easier,
        blanks=blanks,
    )


def _question(trial: ThresholdRecord) -> Question:
    return Question(trial.factor, trial.task, trial.function, trial.easier, trial.group_factor, trial.group)
