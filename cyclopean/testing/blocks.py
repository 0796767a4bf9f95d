"""The promises of every kind of block, tried on one: killed, resumed, replayed, simulated, reported, exported."""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from analysis.kinds import Trial
from analysis.records import SessionLog, read_session, session_files
from analysis.report import parts_of
from cyclopean.answers import report
from cyclopean.datasets import export_bids
from cyclopean.pictures import write_picture
from cyclopean.sessions import check
from cyclopean.testing.promises import BrokenPromiseError, must
from documents import InputError
from documents.files import read_regular
from runner.errors import SessionError
from runner.ports import Ask, Holding, KeyPress
from runner.protocol import Experiment, read_experiment
from runner.scene import Scene
from runner.session import Backend, Event, Resumed, SceneShown, Session, SessionOptions, run_session

NAMES = ("a", "b", "c", "d", "e", "f")
"""The stimuli that a proof shows; ``scene`` is beach for three and church for three, ``codec`` 1, 2, 3."""


@dataclass(frozen=True, slots=True)
class Proof:
    """What was tried: the ``trials`` of a whole session, and how often it was ``cut`` short and went on."""

    trials: int
    cut: int
    report: Path


def prove_block(entry: str, folder: str | Path, *, cuts: int = 60, backend: Backend = "egl") -> Proof:
    """Prove that a kind of block keeps what the program promises of every kind.

    A study of six small pictures is written, with the block between two pages of words. It is checked; simulated
    observers of equal seeds answer alike; a session whose log is cut short, between lines and within them, goes on to
    the same answers; a session that is replayed records them again; nothing is shown that the record does not name; and
    the results are read, reported and exported.

    Parameters
    ----------
    entry
        The block as it stands under ``blocks:``, such as ``"kind: same_or_different, trials: 6"``; its stimuli are
        `NAMES`.
    folder
        An empty folder to work in.
    cuts
        After how many places of the log, spread over it, the session is cut short.
    backend
        Where to draw: ``egl``, without a screen, or ``window``.

    Returns
    -------
    Proof
        What was tried.

    Raises
    ------
    BrokenPromiseError
        If a promise is not kept.
    InputError
        If the entry itself is wrong.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     prove_block("kind: all_pairs, stimuli: [a, b, c]", folder, cuts=2).trials
    5
    """
    study = Study(Path(folder), entry, backend)
    checked = check(study.experiment)
    if checked.value.errors:
        raise InputError(checked.value.errors)
    whole = study.run("whole")
    told = answers_of(whole)
    must(bool(told) and not whole.pending, "a session comes to its end", "it recorded no trial, or left some")
    must(answers_of(study.run("again")) == told, "equal seeds make equal sessions", "two sessions of one seed differ")
    for trial in whole.answers:
        beyond = ", ".join(sorted(study.shown[trial.place] - {*trial.stimuli}))
        must(not beyond, "a record names what was shown", f"that of trial {trial.place} does not name {beyond}")
    torn = list(_torn(read_regular(whole.file, 100_000_000), cuts))
    for kept in torn:
        resumed = study.goes_on(whole, kept)
        must(resumed == told, "it goes on where it stopped", f"cut after {len(kept)} bytes it went on otherwise")
    again = study.resumed(whole, torn[len(torn) // 2])
    known = len(read_session(study.cut).answers)
    must(
        answers_of(again)[:known] == told[:known] and not again.pending,
        "no answer is lost",
        "a resumed session lost one",
    )
    must(answers_of(study.replayed(whole)) == told, "a replay records the same", "a replay recorded other answers")
    for part in parts_of([whole])[1]:
        must(False, "its part of the report is made", part.reason)
    page = report(study.folder / "whole", output=study.folder / "report.html", with_simulated=True)
    export_bids(study.folder / "whole", folder=study.folder / "bids", with_simulated=True)
    return Proof(len(told), len(torn), page)


class Study:
    """A study of six pictures in a folder, and the sessions that are run of it."""

    def __init__(self, folder: Path, entry: str, backend: Backend = "egl") -> None:
        self.folder, self._backend = folder, backend
        self.experiment = folder / "proof.yaml"
        self.shown: defaultdict[tuple[int, int], set[str]] = defaultdict(set)
        self.cut = folder / "cut.jsonl"
        self._observers = folder / "observers.yaml"
        pictures, scores = [], []
        for number, name in enumerate(NAMES):
            level = 10.0 + 3.0 * number
            write_picture(folder / f"{name}.exr", np.full((8, 12, 3), level), np.full((8, 12, 3), level + 1.0))
            factors = f"{{scene: {'beach' if number < 3 else 'church'}, codec: {number % 3 + 1}}}"
            pictures.append(f"  - {{name: {name}, file: {name}.exr, factors: {factors}}}\n")
            scores.append(f"  {name}: {{score: {2.0**-number}}}\n")
        self._observers.write_text(_OBSERVERS + "".join(scores), encoding="utf-8")
        (folder / "pictures.yaml").write_text(_PICTURES + "".join(pictures), encoding="utf-8")
        (folder / "rig.yaml").write_text(_RIG, encoding="utf-8")
        self.experiment.write_text(_EXPERIMENT.format(entry=entry), encoding="utf-8")

    @cached_property
    def design(self) -> Experiment:
        """The experiment, as it is run."""
        return read_experiment(self.experiment)

    def run(self, name: str, observer: str = "01", **options: Any) -> SessionLog:
        """Run a session of an observer, into a folder of that name, and read its log."""
        answers: dict[str, Any] = {} if "replay" in options else {"simulate": self._observers}
        results, listeners = self.folder / name, (self, *options.pop("listeners", ()))
        given = SessionOptions(results, backend=self._backend, listeners=listeners, **answers, **options)
        run_session(self.experiment, observer, given)
        return read_session(next(session_files(results)))

    def goes_on(self, log: SessionLog, kept: bytes) -> list[tuple[Any, ...]]:
        """Let a session go on whose log is only what was ``kept``, with the presses of the whole one; on no screen."""
        self.cut.write_bytes(kept)
        before = read_session(self.cut)
        left = deque(press for trial in log.answers[len(before.answers) :] for press in trial.events)
        stage = _Stage(left)
        session = Session(self.design.blocks("01"), stage, stage, stage, Resumed.of(before))
        try:
            session.run()
        except (IndexError, SessionError) as error:
            raise BrokenPromiseError(
                f"it goes on where it stopped: cut after {len(kept)} bytes it asked more"
            ) from error
        return answers_of(session)

    def resumed(self, log: SessionLog, kept: bytes, **options: Any) -> SessionLog:
        """Let the session go on by itself, drawn and recorded."""
        self.cut.write_bytes(kept)
        place = self.folder.joinpath("resumed", *log.file.relative_to(self.folder).parts[1:])
        place.parent.mkdir(parents=True)
        place.write_bytes(kept)
        return self.run("resumed", resume=True, **options)

    def replayed(self, log: SessionLog) -> SessionLog:
        """Repeat the presses of a session."""
        return self.run("replayed", replay=log.file)

    def hear(self, event: Event) -> None:
        """Keep the names of what is shown in each trial."""
        if isinstance(event, SceneShown):
            self.shown[event.shown.block, event.shown.trial] |= {*event.shown.stimuli} & {*NAMES}


@dataclass(slots=True)
class _Stage:
    """A screen on which nothing is drawn, an observer who presses what is ``left``, and a log that keeps nothing."""

    left: deque[tuple[str, float]]

    def show(self, scene: Scene) -> float:
        return 0.0

    def prefetch(self, scene: Scene) -> None:
        pass

    def hold(self, scene: Scene, seconds: float) -> Holding:
        return Holding(0.0, round(seconds * 60), 1 / 60)

    def respond(self, ask: Ask, onset_s: float) -> KeyPress:
        key, seconds = self.left.popleft()
        return KeyPress(key, onset_s + seconds)

    def hear(self, event: Event) -> None:
        pass


def answers_of(log: SessionLog | Session) -> list[tuple[Any, ...]]:
    """Return what the trials of a session say that is their kind's own, and how long each answer took."""
    return [(trial.place, trial.kind, trial.response_time_s, {**trial.details(), **_SHOWN}) for trial in log.answers]


def _torn(log: bytes, cuts: int) -> Iterator[bytes]:
    """Yield the log cut short at places spread over it: at the ends of lines, and within them; never in its header."""
    first = log.index(b"\n") + 1
    ends = [place + 1 for place in range(first, len(log) - 1) if log[place : place + 1] == b"\n"]
    places = sorted({*ends, *(end + 7 for end in ends)} | {first})
    step = max(1, len(places) // max(1, cuts))
    for place in places[::step][:cuts]:
        yield log[:place]


# How a trial was shown, which is not the kind's own.
_SHOWN = dict.fromkeys(set(Trial.model_fields) - {"practice_of"})
_EXPERIMENT = """\
schema_version: 1
name: proof
rig: rig.yaml
stimuli: pictures.yaml
question: Which is closer?
layout: {{arrangement: vertical, size_mm: [60, 40], gap_mm: 10}}
blocks:
  - {{kind: instructions, text: Look.}}
  - {{{entry}}}
  - {{kind: instructions, text: Thank you.}}
"""
_RIG = """\
schema_version: 1
display:
  nominal: srgb
  white_cd_m2: 100
  panel: {resolution_px: [1920, 1080], pixel_pitch_mm: 0.2768, refresh_hz: 60}
mode: side-by-side
distance_mm: 700
"""
_PICTURES = """\
schema_version: 1
kind: pictures
stimuli:
"""
_OBSERVERS = """\
schema_version: 1
kind: bradley_terry
source: a proof
median_response_time_s: 1.0
stimuli:
"""
