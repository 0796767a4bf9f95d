"""Where presses come from: a person at the presenter's window, or a recorded session played back.

A person uses keys, mouse, wheel, gamepad, or a response box that acts as a keyboard. A replay repeats the same presses
the same time after each scene's onset.
"""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from analysis.kinds import Trial
from analysis.records import Header, SessionLog, read_session, session_files
from documents import Finding
from runner.errors import SessionError
from runner.ports import DOUBLE_S, MOST_IGNORED, Ask, Choose, Ignored, KeyPress, Rate, Task, Why, WindowClosed, Write
from runner.scene import Offset

Press = tuple[str, float]
Place = tuple[int, int]

# What a key that is held down may repeat, as long as it means the same: erasing, and moving along a scale.
HELD_MEANINGS = frozenset({"erase", "lower", "higher"})
# Moves within a question, which may follow one another as fast as they come; and what goes on within a series.
_MOVES = frozenset({"erase", "lower", "higher", "upwards", "downwards"})
_LEAFING = frozenset({"previous", "next"})
# What is no key of its own, or repeats one: it is recorded only where it means something.
_NO_KEYS = ("again ", "text ", "click ", "wheel_")
QUIET_S = 0.1  # nobody presses sooner after another press on purpose


def _no_mouse(wanted: bool, at_once: bool) -> None:
    """Point nowhere."""


@dataclass(slots=True)
class Person:
    """Waits for presses from ``wait_key``, which sleeps until the next one and returns it with its time.

    ``point`` lets the mouse point, or no longer; after a click its pointer is there at once, otherwise once it moves.
    Presses that came too early, twice, from a key held down, or from a key that means nothing to the ask are returned
    as ignored with the answer; clicks, steps of the wheel and characters that mean nothing are dropped.
    """

    wait_key: Callable[[], KeyPress]
    point: Callable[[bool, bool], object] = _no_mouse
    clock: Callable[[], float] = time.monotonic
    _by_mouse: bool = field(init=False, default=False)
    _last: KeyPress = field(init=False, default=KeyPress("", -math.inf))
    _meaning: str | None = field(init=False, default=None)
    _ended: KeyPress = field(init=False, default=KeyPress("", -math.inf))
    _latest_s: float = field(init=False, default=-math.inf)
    _task: Task | None = field(init=False, default=None)
    _since_s: float = field(init=False, default=0.0)
    _goes_on: bool = field(init=False, default=False)

    def respond(self, ask: Ask, onset_s: float) -> KeyPress:
        """Return the first press after the onset that means something here, or of ``escape``.

        An answer must come ``ask.least_s`` after the onset and a tenth of a second after any other press, and is no
        second press of what answered the scene before. Whoever types, or moves along a scale, is faster than pages are
        drawn: there a press counts from when the field or scale was first shown, with the onset as its time if it was
        made before that.
        """
        self.point(bool(ask.targets), self._by_mouse)
        self._goes_on = self._continues(ask.task)
        if not self._goes_on:
            # A scene like the one before it is not drawn again: what was pressed until now is before it all the same.
            self._since_s = onset_s if onset_s > self._last.time_s else self.clock()
        self._task = ask.task
        ignored: list[Ignored] = []
        more = 0
        try:
            while True:
                press = self._read(ask, self.wait_key())
                if press is None:
                    continue
                meaning = ask.meaning(press.key.removeprefix("again "))
                if meaning is None and press.key != "escape":
                    if ask.typing or press.key.startswith(_NO_KEYS):
                        continue
                    why: Why | None = "no_meaning"
                else:
                    why = self._refusal(press, meaning, ask.least_s)
                if why is None:
                    self._take(press, meaning)
                    return KeyPress(press.key, max(press.time_s, onset_s), tuple(ignored), more)
                dropped = Ignored(press.key.removeprefix("again "), round(press.time_s - onset_s, 6), why)
                if why == "held" and any((known.key, known.why) == (dropped.key, "held") for known in ignored):
                    continue  # a key that stays down is one press
                if len(ignored) < MOST_IGNORED:
                    ignored.append(dropped)
                else:
                    more += 1
        finally:
            self.point(False, False)

    def _refusal(self, press: KeyPress, meaning: str | None, least_s: float) -> Why | None:
        """Return why ``press`` is no answer; None if it is one."""
        if press.key.startswith("again "):
            return "held"
        before_s, self._latest_s = self._latest_s, press.time_s
        if press.key.startswith("click "):
            before, again = self._last, self._last.key.startswith("click ")
        else:
            before, again = self._ended, _same_key(press, self._ended) and not self._goes_on
        if again and press.time_s - before.time_s < DOUBLE_S:
            return "double"
        if meaning is None:
            return None  # Escape opens the menu whenever it was pressed
        if press.time_s < self._since_s:
            return "before"
        if self._goes_on or meaning in _MOVES or press.key.startswith("text "):
            return None
        if press.time_s - self._since_s < least_s or press.time_s - before_s < min(least_s, QUIET_S):
            return "early"
        return None

    def _take(self, press: KeyPress, meaning: str | None) -> None:
        self._last, self._meaning = press, meaning
        self._by_mouse = press.key.startswith("click ")
        if meaning not in _MOVES | _LEAFING and not press.key.startswith("text "):
            self._ended = press

    def _continues(self, task: Task) -> bool:
        """Return whether ``task`` is the one that was answered last, and that answer did not end it."""
        before, meaning = self._task, self._meaning
        if isinstance(task, Write) and isinstance(before, Write):
            return task.name == before.name and meaning != "accept"
        if isinstance(task, Rate) and isinstance(before, Rate):
            moved = meaning in ("lower", "higher") or (task.current is not None and meaning == str(task.current))
            return (task.name, task.stimulus) == (before.name, before.stimulus) and moved
        if isinstance(task, Choose) and isinstance(before, Choose):
            return task.name == before.name and meaning in ("upwards", "downwards")
        return False

    def _read(self, ask: Ask, press: KeyPress) -> KeyPress | None:
        """Return what a click hit, a key by its place, and what a held key does again; None if that is nothing."""
        kind, _, rest = press.key.partition(" ")
        if kind == "click_at":
            meaning = hit(ask, rest)
            return None if meaning is None else KeyPress(f"click {meaning}", press.time_s)
        press = _as_it_counts(ask, press)
        if kind == "again":
            rest = press.key.removeprefix("again ")
            meaning = ask.meaning(rest)
            held = meaning in HELD_MEANINGS and (self._last.key, self._meaning) == (rest, meaning)
            return replace(press, key=rest) if held else press
        return press


def _as_it_counts(ask: Ask, press: KeyPress) -> KeyPress:
    """Return ``press`` under the name of its place, with the other in exchange, where only that means something."""
    again = "again " if press.key.startswith("again ") else ""
    printed = press.key.removeprefix(again)
    if not press.by_place or ask.meaning(printed) is not None or ask.meaning(press.by_place) is None:
        return press
    return replace(press, key=f"{again}{press.by_place}", by_place=printed)


def _same_key(one: KeyPress, other: KeyPress) -> bool:
    """Whether both are of one key, by whichever of its names they counted."""
    return {one.key, one.by_place or one.key} == {other.key, other.by_place or other.key}


def hit(ask: Ask, words: str) -> str | None:
    """Return the meaning of the target at a place such as ``12,-40``, None if there is none."""
    across, _, down = words.partition(",")
    place: Offset = (int(across), int(down))
    return next((meaning for meaning, target in ask.targets.items() if target.holds(place)), None)


_ASK_AGAIN: tuple[Press, ...] = (("escape", 0.0), ("r", 0.0))  # through the pause's menu


@dataclass(slots=True)
class Replay:
    """Presses what was pressed; the window counts as closed once a session that was never finished has no more."""

    presses: deque[Press]

    @classmethod
    def of(cls, log: SessionLog) -> Replay:
        """Return an observer who repeats what ``log`` holds."""
        script: list[Press] = []
        for answer, at_once in _in_order(log):
            script += [*(_ASK_AGAIN if at_once else ()), *answer.events]
        return cls(deque(script))

    def respond(self, ask: Ask, onset_s: float) -> KeyPress:
        """Return the next press of the log."""
        if not self.presses:
            raise WindowClosed
        key, time_s = self.presses.popleft()
        if ask.meaning(key) is None and key != "escape":
            raise SessionError(f"the recorded session has the key '{key}' where only {sorted(ask.keys)} can be pressed")
        return KeyPress(key, onset_s + time_s)


def asked_after_their_block(log: SessionLog) -> tuple[Place, ...]:
    """Return the places of trials that were asked once more not at once but after their block."""
    return tuple(answer.place for answer, at_once in _in_order(log) if answer.attempt and not at_once)


def _in_order(log: SessionLog) -> list[tuple[Trial, bool]]:
    """Return the answers with whether each was asked once more at once, as the observer asked in the pause.

    Such an answer follows the one that it repeats.
    """
    marked_by: dict[Place, list[str]] = {}
    for mark in log.marks:
        marked_by.setdefault((mark.block, mark.trial), []).append(mark.by)
    answers = []
    before: Place | None = None
    for answer in log.answers:
        by = marked_by.get(answer.place, [])
        observers = 0 < answer.attempt <= len(by) and by[answer.attempt - 1] == "observer"
        answers.append((answer, observers and before == answer.place))
        before = answer.place
    return answers


def read_recording(path: Path) -> SessionLog:
    """Read the one session log that ``path`` is or holds.

    Raises
    ------
    InputError
        If there is none, or more than one.
    """
    files = list(session_files(path))
    if len(files) != 1:
        raise SessionError(Finding(f"there are {len(files)} sessions here", str(path), remedy="name one session.jsonl"))
    return read_session(files[0])


def check_replayable(
    log: SessionLog, experiment: str, observer: str, now: Mapping[str, str], *, accept_changes: bool = False
) -> tuple[str, ...]:
    """Return what a replay's record must say of it.

    Raises
    ------
    SessionError
        If the session was of another experiment or observer, or something changed since, unless that is accepted.
    """
    header = log.header
    if (header.experiment, header.observer) != (experiment, observer):
        what = f"the recorded session is of '{header.experiment}' and observer {header.observer}"
        remedy = f"replay it with the experiment '{header.experiment}' and --observer {header.observer}"
        raise SessionError(Finding(what, str(log.file), 1, 1, remedy))
    changed = changes(header, now)
    if changed and not accept_changes:
        what = f"the {' and the '.join(changed)} changed since the recorded session"
        remedy = "restore what it was made with, or replay it with --accept-changes"
        raise SessionError(Finding(what, str(log.file), 1, 1, remedy))
    remark = f"a replay of session {header.session}"
    return (remark + (f", although the {' and the '.join(changed)} changed" if changed else ""),)


def changes(header: Header, now: Mapping[str, str]) -> dict[str, dict[str, str | None]]:
    """Return what differs from when a session began: SHA-256 ``before`` and ``now``, by name."""
    return {
        name: {"before": header.hashes.get(name), "now": digest}
        for name, digest in now.items()
        if header.hashes.get(name) != digest
    }
