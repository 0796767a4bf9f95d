"""The answers of all observers in a folder of results, for blocks that choose their pairs by them.

Logs are read between batches, on from where they were read to, and nothing is written or locked: other stations go on
as if nobody looked. What cannot be read in `MOST_S` is read before the next batch.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path

import numpy as np

from analysis.errors import ResultsError
from analysis.kinds import PairRecord, Trial
from analysis.records import GrowingLog, Header, PooledBatch, SessionLog, session_files
from documents import Finding
from documents.arrays import Floats
from runner.blocks.block import Pooled
from runner.errors import SessionError
from runner.ports import ChooseBatch, PooledAnswers, WindowClosed
from runner.protocol.experiment import Experiment

MOST_S = 0.04
"""Seconds after which no further log is opened while a session runs."""
_REMEDY = "choose another folder with --results, or give the experiment another name"


@dataclass(slots=True)
class _Pooled:
    """A log in the pool: its answers that count, by block and trial, and why it is ``left_out``, if it is."""

    log: GrowingLog
    left_out: Finding | None = None
    is_foreign: bool = False
    restarts: int = 0
    looked_at_s: float = -math.inf
    answers: dict[int, dict[int, PairRecord]] = field(default_factory=dict)
    _wins: dict[int, Floats] = field(default_factory=dict)

    def add(self, answers: tuple[Trial, ...]) -> None:
        """Add answers, of which the last to each trial counts."""
        if self.log.restarts > self.restarts:
            self.restarts = self.log.restarts
            self.answers.clear()
            self._wins.clear()
        for answer in answers:
            assert isinstance(answer, PairRecord)  # of another kind there is a finding
            self.answers.setdefault(answer.block, {})[answer.trial] = answer
            self._wins.pop(answer.block, None)

    def wins(self, block: int, stimuli: tuple[str, ...]) -> Floats:
        """Return how many times stimulus i won over j, shape (n, n); a tie is half a win for each."""
        if block not in self._wins:
            number = {name: place for place, name in enumerate(stimuli)}
            wins: Floats = np.zeros((len(stimuli), len(stimuli)))
            for answer in self.answers[block].values():
                first, second = (number[name] for name in answer.stimuli)
                share = 0.5 if answer.is_tie else float(answer.answer == "first")
                wins[first, second] += share
                wins[second, first] += 1.0 - share
            self._wins[block] = wins
        return self._wins[block]


@dataclass(slots=True)
class ResultsPool:
    """The sessions of ``experiment`` in ``results``, on all stations.

    A session counts with the answers that it has so far, of each trial the last, whether it runs, was stopped or is
    complete; of a person with those of people, of a simulated observer with those of simulated ones. A log that is
    damaged or was changed is left out, and so is one of another experiment; ``note`` is called with why, once.
    """

    experiment: Experiment
    results: Path
    note: Callable[[str], None] = lambda words: None
    simulated: bool = False
    own: str = ""
    """The label of the session that asks, which counts its own answers itself."""
    _logs: dict[Path, _Pooled] = field(default_factory=dict)
    _told: set[str] = field(default_factory=set)
    _blocks: dict[int, Pooled] = field(init=False)

    def __post_init__(self) -> None:
        self._blocks = pooled_blocks(self.experiment)

    def look(self, most_s: float | None = None) -> None:
        """Read what was added to the logs, for about so many seconds or from one log at least; all of it if None."""
        begun_s = time.monotonic()
        files = session_files(self.results / self.experiment.spec.name)
        self._logs = {file: self._logs.get(file) or _Pooled(GrowingLog(file)) for file in files}
        for file, one in sorted(self._logs.items(), key=lambda known: known[1].looked_at_s):
            self._read(file, one, whole=most_s is None)
            one.looked_at_s = time.monotonic()
            if most_s is not None and one.looked_at_s - begun_s > most_s:
                return

    def foreign(self) -> list[Finding]:
        """Return one finding for each log that was read and is of another experiment."""
        return [one.left_out for one in self._logs.values() if one.left_out and one.is_foreign and self._counts(one)]

    def left_out(self) -> list[Finding]:
        """Return one finding for each log that was read and does not count."""
        return [one.left_out for one in self._logs.values() if one.left_out and self._counts(one)]

    def _counts(self, one: _Pooled) -> bool:
        """Return whether a log is of a person, or of a simulated observer, as the session that asks."""
        header = one.log.header
        return header is None or header.simulated == self.simulated

    def refuse_foreign(self) -> None:
        """Raise SessionError if the folder has sessions of another experiment."""
        if foreign := self.foreign():
            more = f" (and {len(foreign) - 1} more sessions there)" if len(foreign) > 1 else ""
            first = foreign[0]
            raise SessionError(Finding(first.message + more, first.file, first.line, first.column, first.remedy))

    def batch(self, block: int, trial: int, step: ChooseBatch) -> PooledBatch:
        """Let the block choose by what all other sessions answered until now."""
        self.look(MOST_S)
        for finding in self.left_out():
            if (words := str(finding)) not in self._told:
                self._told.add(words)
                self.note(f"left out of the answers that pairs are chosen by: {words}")
        return step.choose(self.answers(block, step.stimuli))

    def answers(self, block: int, stimuli: tuple[str, ...]) -> PooledAnswers:
        """Return what was read of the answers of all other sessions to a block of ``stimuli``."""
        wins: Floats = np.zeros((len(stimuli), len(stimuli)))
        sessions: dict[str, int] = {}
        for one in self._logs.values():
            header, given = one.log.header, len(one.answers.get(block, ()))
            if header is None or one.left_out or not given:
                continue
            name = f"{header.observer}/{header.session}"
            # Of a log that was copied within the folder, one counts.
            if self._counts(one) and header.session != self.own and name not in sessions:
                sessions[name] = given
                wins += one.wins(block, stimuli)
        return PooledAnswers(wins, sessions)

    def _read(self, file: Path, one: _Pooled, *, whole: bool) -> None:
        try:
            while not one.left_out:
                answers = one.log.read()
                if one.log.header is None:
                    return  # another station is writing it
                faults = chain(self._other_experiment(one.log.header, file), self._other_pairs(answers, file))
                if fault := next(faults, None):
                    one.left_out, one.is_foreign = fault, True
                    return
                one.add(tuple(answer for answer in answers if answer.block in self._blocks))
                if not whole or one.log.is_read:
                    return
        except FileNotFoundError:
            return  # it was moved away
        except ResultsError as error:
            one.left_out = error.findings[0]

    def _other_experiment(self, header: Header, file: Path) -> Iterator[Finding]:
        """Yield how the session of a log differs from this experiment in what it asks."""
        spec, known = self.experiment.spec, self.experiment.stimuli.factors
        if header.experiment != spec.name:
            yield _finding(f"this session is of '{header.experiment}', not of '{spec.name}'", file)
        shown = set(header.stimulus_names)
        if differing := shown ^ known.keys():
            where = "only in it" if min(differing) in shown else "not in it"
            yield _finding(f"this session of '{spec.name}' shows other stimuli: '{min(differing)}' is {where}", file)
        if header.question != spec.question:
            yield _finding(f"this session of '{spec.name}' asks another question: {header.question!r}", file)
        kinds = [one.kind for one in header.planned]
        for index in self._blocks:
            if kinds and kinds[index : index + 1] != [spec.blocks[index].kind]:
                there = f"is '{kinds[index]}'" if index < len(kinds) else "is missing"
                yield _finding(f"this session of '{spec.name}' has other blocks: its block {index + 1} {there}", file)

    def _other_pairs(self, answers: tuple[Trial, ...], file: Path) -> Iterator[Finding]:
        """Yield answers that do not belong to the block of this experiment at their place."""
        for answer in answers:
            if answer.block not in self._blocks:
                continue
            names, pairs = self._blocks[answer.block]
            pair = [names.index(name) for name in _compared(answer) if name in names]
            is_asked = len(pair) == 2 and (pairs is None or (min(pair), max(pair)) in pairs)
            if answer.kind != self.experiment.spec.blocks[answer.block].kind or not is_asked:
                words = " with ".join(f"'{name}'" for name in _compared(answer)) or f"no pairs but '{answer.kind}'"
                what = f"this session of '{self.experiment.spec.name}' compares {words} in block {answer.block + 1}"
                yield _finding(f"{what}, which this experiment does not", file)


@dataclass(slots=True)
class RecordedPool:
    """The batches of a recorded session, for its replay: no folder is looked at."""

    log: SessionLog

    def batch(self, block: int, trial: int, step: ChooseBatch) -> PooledBatch:
        """Return the batch that was recorded; raise WindowClosed where the session stopped before."""
        for batch in self.log.pooled:
            if batch.place == (block, trial):
                return batch
        raise WindowClosed


def pooled_blocks(experiment: Experiment) -> dict[int, Pooled]:
    """Return what blocks compare that choose by the answers of all, by the numbers of the blocks."""
    blocks = enumerate(experiment.spec.blocks)
    return {number: pooled for number, block in blocks if (pooled := block.pooled(experiment.stimuli))}


def _compared(answer: Trial) -> tuple[str, ...]:
    return answer.stimuli if isinstance(answer, PairRecord) else ()


def _finding(what: str, file: Path) -> Finding:
    return Finding(f"{what}, so their answers cannot be pooled", str(file), 1, 1, _REMEDY)
