"""Sessions of an experiment that chooses pairs by the answers of all observers, without a screen."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from analysis.records import FILE_NAME, Header, SessionLog, new_header, read_session
from runner.ports import Ask, KeyPress, ObserverLeft, Pool
from runner.protocol import Experiment
from runner.session import Session
from runner.session.header import planned
from runner.session.pooling import ResultsPool
from tests.runner.every_kind import Fickle, Stage, opened

Stop = Callable[[int], None]
_NUMBERS = itertools.count()


class Person(Fickle):
    """Answers at random, and calls ``before`` with the number of answers given before each."""

    def __init__(self, seed: int, before: Stop) -> None:
        super().__init__(seed)
        self.before, self.given = before, 0

    def respond(self, ask: Ask, onset_s: float) -> KeyPress:
        self.before(self.given)
        self.given += 1
        return super().respond(ask, onset_s)


def leave_after(answers: int) -> Stop:
    """Return what lets an observer leave after so many answers."""

    def before(given: int) -> None:
        if given == answers:
            raise ObserverLeft

    return before


def header_of(design: Experiment, observer: str, label: str, **more: Any) -> Header:
    """Return the header of a session of ``design``."""
    stimuli = tuple({"name": name, "factors": dict(levels)} for name, levels in design.stimuli.factors.items())
    plan = planned(design, design.blocks(observer))
    facts = {"planned": plan, **more}
    utc = "2026-01-01T00:00:00.000+00:00"
    return new_header(design.spec.name, observer, label, utc, question=design.spec.question, stimuli=stimuli, **facts)


def sit(
    design: Experiment,
    results: Path,
    observer: str,
    before: Stop = lambda given: None,
    *,
    seed: int = 1,
    label: str = "",
    pool: Pool | None = None,
    **more: Any,
) -> SessionLog:
    """Run a session to its end, or until the observer leaves; resume it where ``label`` is known. Return its log."""
    label = label or f"s{next(_NUMBERS)}"
    folder = results / design.spec.name / f"sub-{observer}" / f"ses-{label}"
    file = folder / FILE_NAME
    recorder, resumed = opened(folder, header_of(design, observer, label, **more))
    pool = pool or ResultsPool(design, results, own=label)
    with recorder:
        session = Session(design.blocks(observer), Stage(), Person(seed, before), recorder, resumed, pool=pool)
        if isinstance(pool, ResultsPool):
            pool.look()  # as a station does before it begins
            pool.note = lambda words: session.note(words, "program")
        with suppress(ObserverLeft):
            session.run()
    return read_session(file)


def asked(log: SessionLog) -> list[tuple[str, str]]:
    """Return the pairs that were asked about, in their order."""
    pairs = [answer for answer in log.first_attempts if answer.kind == "active_pairs"]
    return [(str(answer.details()["first"]), str(answer.details()["second"])) for answer in pairs]
