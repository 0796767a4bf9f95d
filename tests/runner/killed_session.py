"""A session in a process of its own, made to be killed: run as a program by test_kill.py.

It tells on standard output what it does, a line at a time, so that the test knows which answers were given before
the process died: ``asked FIRST SECOND`` once a trial is awaited (all trials before it are recorded by then), ``end``
once the session is complete. Each folder that it is told on standard input it gives to a process forked from it, of
which it tells ``process NUMBER`` and, on a line of its own, ``gone``: to start Python each time would take long.
"""

from __future__ import annotations

import io
import os
import random
import sys
import time
import traceback
from contextlib import redirect_stdout
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from analysis.records import FILE_NAME, Header, read_session
from runner.blocks.all_pairs import AllPairs
from runner.blocks.layout import PairLayout
from runner.blocks.message import Message
from runner.observers import BradleyTerryObserver
from runner.ports import Ask, Holding, KeyPress
from runner.presenter import Scene
from runner.session import Session
from runner.session.folders import Recorder

NAMES = tuple("abcdefgh")
LAYOUT = PairLayout("vertical", (0, -60), (0, 60), (100, 80), (0, -140), 400)
STIMULI = tuple({"name": name} for name in NAMES)
HEADER = Header("e", "01", "s", "2026-01-01T00:00:00+00:00", 0, "Which?", True, STIMULI, {}, {}, {}, {}, {})


def tell(*words: str) -> None:
    """Write a line at once: what a killed process had in its buffers would be lost."""
    sys.stdout.write(" ".join(words) + "\n")
    sys.stdout.flush()


class _Screen:
    def show(self, scene: Scene) -> float:
        return time.monotonic()

    def prefetch(self, scene: Scene) -> None:
        pass

    def hold(self, scene: Scene, seconds: float) -> Holding:
        return Holding(self.show(scene), 1, seconds)


class _Slow(BradleyTerryObserver):
    """Answers after a few milliseconds, so that a kill falls before, between and after answers."""

    def respond(self, ask: Ask, onset_s: float) -> KeyPress:
        if ask.scene.stimuli:
            tell("asked", *ask.scene.stimuli)
        time.sleep(self.rng.uniform(0.0, 0.006))
        return super().respond(ask, onset_s)


def main(folder: Path) -> None:
    """Begin the session in ``folder``, or resume it."""
    if (folder / FILE_NAME).exists():
        recorder, log = Recorder.reopen(folder)
        logged = log.first_attempts
    else:
        recorder, logged = Recorder.create(folder, replace(HEADER)), ()
    observer = _Slow({name: 1.0 + index for index, name in enumerate(NAMES)}, random.Random())
    pairs = AllPairs(NAMES, "Which?", LAYOUT, "side", "order", break_every=5)
    with recorder:
        blocks = (Message("instructions", "Look."), pairs, Message("break", "Rest."))
        Session(blocks, _Screen(), observer, recorder, logged=logged).run()
    tell("end")


def fork(folder: Path) -> None:
    """Let a process run the session, and wait until it is gone."""
    child = os.fork()
    if child == 0:
        tell("process", str(os.getpid()))
        try:
            main(folder)
        except BaseException:
            traceback.print_exc()
        os._exit(0)
    os.waitpid(child, 0)
    tell("\ngone")


if __name__ == "__main__":
    # What a session imports and reads once is there before processes are forked: not each does it again.
    with TemporaryDirectory() as scratch, redirect_stdout(io.StringIO()):
        main(Path(scratch) / "s")
        read_session(Path(scratch) / "s" / FILE_NAME)
    for line in sys.stdin:
        fork(Path(line.rstrip("\n")))
