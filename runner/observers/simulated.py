"""Simulated observers that answer every task by known scores, or by how far pictures are from a reference picture.

`plain_key` gives the simplest answer to anything: that of a preview, and the fallback of simulated observers.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Self

import numpy as np

from analysis.records import PooledBatch
from devices.colour import delta_e_2000, xyz_to_lab
from devices.display import EyeModels
from documents import Finding
from documents.arrays import Floats
from runner.blocks.block import Block, Draft, SessionEnd
from runner.errors import SessionError
from runner.observers.behaviour import ATTENTIVE, BehaviourSpec, choice_law, difficulty, pair_law, psychometric_law
from runner.ports import Ask, Browse, Choose, ChooseBatch, Compare, Hold, KeyPress, NoOthers, Rate, Response, Write
from stimuli.pictures import StereoImage

TIES = ("no_difference", "not_sure")


@dataclass(slots=True)
class BradleyTerryObserver:
    """Prefers picture i to j with probability s_i / (s_i + s_j) [Bradley1952], but for its ``behaviour``.

    Of a series it looks at every picture before it chooses one of them, with probability s_i / Σ s. On a scale it
    places a picture by its log score, the lowest at the lower end and the highest at the upper; on one
    with ``difficult`` in its name, the last choice by the entropy of its odds. Response times are lognormal about their
    median; they are recorded, not waited for.
    """

    scores: Mapping[str, float]
    rng: random.Random
    median_response_time_s: float = 2.0
    behaviour: BehaviourSpec = ATTENTIVE
    _log_scores: dict[str, float] = field(init=False)
    _judged: int = field(init=False, default=0)
    _alternatives: tuple[str, ...] = field(init=False, default=())
    _chosen: str | None = field(init=False, default=None)
    _target: int | None = field(init=False, default=None)
    _rating: tuple[Rate, int] | None = field(init=False, default=None)

    def __post_init__(self) -> None:
        self._log_scores = {name: math.log(score) for name, score in self.scores.items()}

    @classmethod
    def by_log_scores(cls, log_scores: Mapping[str, float], rng: random.Random, behaviour: BehaviourSpec) -> Self:
        """Return an observer whose scores in nats, however far apart, are ``log_scores``."""
        observer = cls({}, rng, behaviour.median_response_time_s, behaviour)
        observer._log_scores = dict(log_scores)
        return observer

    def respond(self, ask: Ask, onset_s: float) -> KeyPress:
        """Do what the task wants next; a time below the least that counts is raised to it."""
        drawn_s = self.median_response_time_s * self.rng.lognormvariate(0.0, 0.4)
        return KeyPress(self._key(ask), onset_s + max(drawn_s, ask.least_s))

    def _key(self, ask: Ask) -> str:
        task = ask.task
        if isinstance(task, Compare):
            return key_for(ask, self._compare(task, ask))
        if isinstance(task, Browse):
            return key_for(ask, self._browse(task))
        if isinstance(task, Rate):
            return key_for(ask, self._rate(task, ask))
        if isinstance(task, Choose):
            return key_for(ask, self._choose(task))
        return plain_key(ask)

    def _compare(self, task: Compare, ask: Ask) -> str:
        means = {*ask.keys.values(), *ask.targets}
        ties = [meaning for meaning in TIES if meaning in means]
        self._alternatives = task.first, task.second
        if self._lapses():
            answer = self.rng.choice(["first", "second", *ties])
        else:
            difference = self._log_score(task.first) - self._log_score(task.second)
            log_odds = difference / self.behaviour.noise(self._judged) + self.behaviour.position_bias
            first, second, _ = pair_law(log_odds, self.behaviour.ties if ties else None)
            drawn = self.rng.random()
            answer = "first" if drawn < first else "second" if drawn < first + second or not ties else self._tie(ties)
        self._judged += 1
        if answer not in ties:
            self._chosen = task.first if answer == "first" else task.second
        return answer

    def _tie(self, ties: list[str]) -> str:
        if len(ties) == 1 or self.behaviour.ties is None:
            return ties[0]
        return ties[self.rng.random() < self.behaviour.ties.not_sure_share]

    def _browse(self, task: Browse) -> str:
        if len(task.seen) < len(task.series):
            self._target = None
            return unseen(task)
        if self._target is None:
            self._target = self._pick(task.series)
        if self._target != task.index:
            return "next" if self._target > task.index else "previous"
        self._target = None
        self._judged += 1
        self._alternatives = task.series
        self._chosen = task.series[task.index]
        return "choose"

    def _pick(self, series: tuple[str, ...]) -> int:
        if self._lapses():
            return self.rng.randrange(len(series))
        noise = self.behaviour.noise(self._judged)
        odds = choice_law([self._log_score(name) / noise for name in series])
        return self.rng.choices(range(len(series)), odds)[0]

    def _rate(self, task: Rate, ask: Ask) -> str:
        means = {*ask.keys.values(), *ask.targets}
        if self._rating is None or not _same(self._rating[0], task) or task.current is None:
            self._rating = task, self._number(task)
        before, number = self._rating
        number = min(max(number, task.lowest), task.highest)
        if task.current == number and "accept" in means:
            return self._accept()
        if str(number) in means:
            return str(number)
        if task.current is None:
            return "higher"
        wanted = "higher" if number > task.current else "lower"
        gone_past = before.current is not None and (before.current > number) != (task.current > number)
        if wanted not in means or gone_past or (before.current == task.current and before is not task):
            return self._accept()  # the marker cannot come closer
        self._rating = task, number
        return wanted

    def _accept(self) -> str:
        self._rating = None
        return "accept"

    def _number(self, task: Rate) -> int:
        length = task.highest - task.lowest
        if self._lapses():
            return task.lowest + self.rng.randrange(length + 1)
        share = self._share(task) + self.rng.gauss(0.0, self.behaviour.rating_noise)
        return round(task.lowest + length * min(max(share, 0.0), 1.0))

    def _share(self, task: Rate) -> float:
        if "difficult" in task.name.lower():
            return difficulty([self._log_score(name) for name in self._alternatives])
        stimulus = task.stimulus or self._chosen
        lowest, highest = min(self._log_scores.values()), max(self._log_scores.values())
        if stimulus is None or lowest == highest:
            return 0.5
        return (self._log_score(stimulus) - lowest) / (highest - lowest)

    def _choose(self, task: Choose) -> str:
        lapses = self._lapses()
        self._judged += 1
        if lapses or task.correct is None:
            return self.rng.choice(task.options)
        function = self.behaviour.psychometric.get(task.name)
        if function is None or (task.strength is None and task.forced):
            return task.correct
        if not task.forced:
            yes, no = task.options
            return yes if self.rng.random() < psychometric_law(task.strength, 0.0, function) else no
        if self.rng.random() < psychometric_law(task.strength, 1.0 / len(task.options), function):
            return task.correct
        return self.rng.choice([option for option in task.options if option != task.correct])

    def _lapses(self) -> bool:
        rate = self.behaviour.lapses(self._judged)
        return rate > 0 and self.rng.random() < rate

    def _log_score(self, name: str) -> float:
        if name not in self._log_scores:
            raise SessionError(f"the simulated observer is asked about '{name}', for which it has no score")
        return self._log_scores[name]


def _same(before: Rate, now: Rate) -> bool:
    """Say whether two tasks are one question, the marker of which has moved."""
    return (before.name, before.stimulus, before.lowest, before.highest) == (
        now.name,
        now.stimulus,
        now.lowest,
        now.highest,
    )


def mean_delta_e_00(
    load: Callable[[str], StereoImage], names: Iterable[str], reference: str, models: EyeModels
) -> dict[str, float]:
    """Return each picture's mean ΔE00 to ``reference``, over all pixels of both eyes' views.

    Lab is relative to each eye's white. What was asked of the display is compared, not what its gamut leaves of it.

    Raises
    ------
    SessionError
        If a picture is not as large as the reference.
    """
    whites = models.left.white_XYZ_cd_m2, models.right.white_XYZ_cd_m2
    reference_labs = _labs(load(reference), whites)
    distances = {}
    for name in names:
        labs = _labs(load(name), whites)
        for lab, other in zip(labs, reference_labs, strict=True):
            if lab.shape != other.shape:
                sizes = f"'{name}' is of {lab.shape[1]} x {lab.shape[0]} px, '{reference}' of " + (
                    f"{other.shape[1]} x {other.shape[0]} px"
                )
                raise SessionError(Finding(sizes, remedy="an image-based observer compares pictures of one size"))
        both = [float(delta_e_2000(lab, other).mean()) for lab, other in zip(labs, reference_labs, strict=True)]
        distances[name] = sum(both) / len(both)
    return distances


def _labs(image: StereoImage, whites: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
    left = xyz_to_lab(image.left.astype(np.float64), whites[0])
    if image.is_flat and np.array_equal(*whites):
        return left, left
    return left, xyz_to_lab(image.right.astype(np.float64), whites[1])


def key_for(ask: Ask, meaning: str) -> str:
    """Return something that an observer can do to mean ``meaning``.

    Raises
    ------
    ValueError
        If nothing means that here.
    """
    for key, meant in ask.keys.items():
        if meant == meaning:
            return key
    if meaning in ask.targets:
        return f"click {meaning}"
    if ask.typing and ask.meaning(meaning) == meaning:
        return meaning
    raise ValueError(f"nothing means '{meaning}' here, only {sorted({*ask.keys.values(), *ask.targets})}")


def plain_key(ask: Ask) -> str:
    """Return a press that continues: the first of two, the last of a series, the middle of a scale, what is right."""
    return key_for(ask, _meaning(ask))


def _meaning(ask: Ask) -> str:
    task = ask.task
    means = {*ask.keys.values(), *ask.targets}
    if isinstance(task, Compare):
        return "first"
    if isinstance(task, Browse):
        return "choose" if "choose" in means and len(task.seen) == len(task.series) else unseen(task)
    if isinstance(task, Rate):
        middle = (task.lowest + task.highest) // 2
        if task.current is None:
            return str(middle) if str(middle) in means else "higher"
        return "accept"
    if isinstance(task, Choose):
        return task.correct or task.options[0]
    if isinstance(task, Write):
        return "accept" if "accept" in means else _next_character(task)
    return next(iter([*ask.keys.values(), *ask.targets]))


def _next_character(task: Write) -> str:
    """Return what gets nearer to the example: its next character, or erasing what is not part of it."""
    if not task.example.startswith(task.typed):
        return "erase"
    return f"text {task.example[len(task.typed) :][:1] or '1'}"


def unseen(task: Browse) -> str:
    """Return the way to the nearest picture of a series that was not seen yet."""
    ahead = [index for index in range(task.index + 1, len(task.series)) if index not in task.seen]
    return "next" if ahead else "previous"


def walk(block: Block) -> Iterator[Ask | Hold | Draft]:
    """Yield what ``block`` yields: what is asked, what is shown for a time, and what would be recorded."""
    steps = block.steps()
    response: Response | PooledBatch | None = None
    while True:
        try:
            step = steps.send(response)
        except (StopIteration, SessionEnd):
            return
        if isinstance(step, ChooseBatch):
            response = NoOthers().batch(0, 0, step)
            continue
        yield step
        response = None
        if isinstance(step, Ask):
            key = plain_key(step)
            response = Response(key, step.meaning(key) or "", 0.0)
