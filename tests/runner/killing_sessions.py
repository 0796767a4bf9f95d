"""Sessions killed again and again: run as a program by test_kill_every_kind.py, told [FOLDER, KIND, VARIANT, SEED]s.

Each round forks a process that begins the session, or goes on with it, and tells what has been kept so far; it is
killed with SIGKILL at a random moment, or while it waits after an answer, so that some kills are sure to come in time.
What it had told, and what then lay on disk, is printed as one JSON object a round, and null when all are over: with
what the checksums say, and how the copy of the log in another folder compares.
"""

from __future__ import annotations

import json
import os
import random
import signal
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from analysis.kinds import Trial
from analysis.records import FILE_NAME, read_session
from analysis.seals import check_log
from documents.files import compare_copy
from runner.blocks import Block
from runner.ports import Ask, KeyPress
from runner.session import Session
from runner.session.folders import LogMirror
from tests.runner.every_kind import Fickle, OnTrial, Stage, blocks_of, opened

MOST_ROUNDS = 60


class _Slow(Fickle):
    def respond(self, ask: Ask, onset_s: float) -> KeyPress:
        time.sleep(self.rng.uniform(0.0, 0.003))
        return super().respond(ask, onset_s)


def _sit(folder: Path, blocks: tuple[Block, ...], seed: int, told: int, waits_after: int) -> None:
    """Run the session to its end; write a line to ``told`` once something is on disk, and wait after some answers."""
    rng = random.Random(seed)
    given = 0

    def tell(*words: object) -> None:
        os.write(told, (json.dumps(words) + "\n").encode())

    recorder, before = opened(folder)
    known = {(answer.place, answer.attempt) for answer in before.answers}
    session = Session(blocks, Stage(), _Slow(seed), recorder, before)

    def on_trial(trial: Trial) -> None:
        if (trial.place, trial.attempt) in known:
            return
        nonlocal given
        given += 1
        tell("answer", *trial.place, trial.attempt)
        if rng.random() < 0.3:
            words = f"{seed}/{rng.random()}"
            session.note(words, "experimenter")
            tell("note", words)
        if rng.random() < 0.3 and not trial.attempt:
            place = session.mark("experimenter")
            if place:
                tell("mark", *place)
        if given == waits_after:
            time.sleep(600)

    copies = folder.parent / "copies"
    copies.mkdir(exist_ok=True)
    mirror = LogMirror(recorder.log, copies / FILE_NAME, copies)
    session.listeners += [mirror, OnTrial(on_trial)]
    with recorder:
        session.run()
    tell("end", mirror.close())


def _round(folder: Path, blocks: tuple[Block, ...], rng: random.Random, *, waiting: bool) -> list[Any]:
    """Let a session run for a moment, kill it, and return what it told."""
    read, write = os.pipe()
    wanted = rng.randint(1, 3) if waiting else rng.randint(0, 8)
    seed = rng.randrange(10**9)
    child = os.fork()
    if child == 0:
        try:
            os.close(read)
            _sit(folder, blocks, seed, write, wanted if waiting else 0)
        except BaseException as error:
            os.write(write, (json.dumps(["error", repr(error)]) + "\n").encode())
        os._exit(0)
    os.close(write)
    told = b""
    while told.count(b'["answer"' if waiting else b"\n") < wanted and (piece := os.read(read, 65536)):
        told += piece
    time.sleep(rng.uniform(0.0, 0.008))
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    while piece := os.read(read, 65536):
        told += piece
    os.close(read)
    return [json.loads(line) for line in told.split(b"\n")[:-1]]  # the last line may have been cut


def main(folder: Path, kind: str, variant: int, seed: int) -> None:
    """Kill until the session is complete."""
    blocks = blocks_of(kind, variant)
    session = folder / "s"
    rng = random.Random(seed)
    for number in range(MOST_ROUNDS):
        told = _round(session, blocks, rng, waiting=number % 2 == 0)
        if not (session / FILE_NAME).exists():
            if session.exists():  # killed before there was a header: nothing was begun
                for path in session.iterdir():
                    path.unlink()
                session.rmdir()
            nothing = {"answers": [], "notes": [], "marks": [], "complete": False, "findings": [], "copy": None}
            print(json.dumps({"told": told, **nothing}))
            continue
        log = read_session(session / FILE_NAME)
        copy = compare_copy(session / FILE_NAME, folder / "copies" / FILE_NAME)
        on_disk = {
            "told": told,
            "answers": [[*answer.place, answer.attempt] for answer in log.answers],
            "notes": [note.text for note in log.notes],
            "marks": [[mark.block, mark.trial] for mark in log.marks],
            "complete": log.complete,
            "findings": [str(finding) for finding in check_log(session / FILE_NAME).findings],
            "copy": copy.differs_at or str(copy),
        }
        print(json.dumps(on_disk))
        if log.complete:
            return


if __name__ == "__main__":
    # What a session imports and reads once is there before processes are forked: not each does it again.
    with TemporaryDirectory() as scratch, open(os.devnull, "wb") as nowhere:
        _sit(Path(scratch) / "s", blocks_of("all_pairs"), 0, nowhere.fileno(), 0)
        read_session(Path(scratch) / "s" / FILE_NAME)
    for line in sys.stdin:
        folder, *words = json.loads(line)
        main(Path(folder), *words)
        print("null", flush=True)
