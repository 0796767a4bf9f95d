"""The session engine: it drives the blocks, shows what they ask, and records what they draft.

A session that was stopped is resumed by replay: the same blocks are started under the same seed, and what the log
already holds is answered from it, without drawing, until the first trial that is not in the log. If a block drafts
another trial than the log holds, the session is refused rather than bent.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any, Protocol

from analysis.records import Trial
from documents import Finding
from runner.blocks.steps import Block, Draft, Hold, Response
from runner.errors import SessionError
from runner.ports import Ask, Holding, Observer, Presenter
from runner.presenter.scene import Scene, Text

LEAVE = Ask(
    Scene(
        (
            Text("Leave the session?", offset_px=(0, -60), height_px=32),
            Text("Every answer so far is saved, and the session can be resumed.", height_px=22),
            Text("Press Y to leave, N to go on", offset_px=(0, 70), height_px=22, luminance_share=0.25),
        )
    ),
    {"y": "leave", "n": "stay", "escape": "stay"},
)


class Sink(Protocol):
    """Where answers go; the recorder in earnest."""

    def append(self, trial: Trial) -> None:
        """Make the trial permanent before returning."""

    def end(self, facts: Mapping[str, Any]) -> None:
        """Note that the session is complete, and ``facts`` of how it went."""


class Left(Exception):
    """The observer asked to leave and confirmed it."""


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="milliseconds")


@dataclass(slots=True)
class Session:
    """One observer's way through the blocks.

    ``clip_costs`` gives, per stimulus, what the trial's record says of the gamut clip; ``marks`` stand in every trial's
    record; ``logged`` is what an interrupted session already holds; ``on_trial`` hears of each trial, also if replayed;
    ``closing_facts`` is asked at the end for what the record should say of the whole.
    """

    blocks: Sequence[Block]
    presenter: Presenter
    observer: Observer
    sink: Sink
    clip_costs: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    marks: Mapping[str, Any] = field(default_factory=dict)
    logged: Sequence[Trial] = ()
    on_trial: Callable[[Trial], None] = lambda trial: None
    closing_facts: Callable[[], Mapping[str, Any]] = dict
    utc: Callable[[], str] = _now
    _past: deque[Trial] = field(init=False)
    _past_events: deque[tuple[str, float]] = field(init=False, default_factory=deque)
    _events: list[tuple[str, float]] = field(init=False, default_factory=list)
    _holding: tuple[str, Holding] | None = field(init=False, default=None)
    _timed: list[dict[str, Any]] = field(init=False, default_factory=list)

    def run(self) -> None:
        """Run to the end and say so in the record.

        Raises
        ------
        Left
            If the observer left; everything answered is recorded.
        WindowClosed
            If the window was closed.
        SessionError
            If the log does not fit the blocks.
        """
        self._past = deque(self.logged)
        self._load_past_events()
        for number, block in enumerate(self.blocks):
            self._run_block(number, block)
        if self._past:
            raise SessionError(f"the log holds {len(self._past)} more trials than the experiment has")
        self.sink.end(self.closing_facts())

    def _run_block(self, number: int, block: Block) -> None:
        steps = block.steps()
        response: Response | None = None
        trial = 0
        while True:
            try:
                step = steps.send(response)
            except StopIteration:
                return
            response = None
            if isinstance(step, Draft):
                self._record(number, trial, step)
                trial += 1
            elif isinstance(step, Hold):
                self._hold(step)
            else:
                response = self._respond(step)

    def _respond(self, ask: Ask) -> Response:
        if self._past_events:
            key, time_s = self._past_events.popleft()
            if key not in ask.keys:
                raise SessionError(f"the log holds the key '{key}' where only {sorted(ask.keys)} can be pressed")
        else:
            key, time_s = self._live(ask)
        self._events.append((key, time_s))
        return Response(key, ask.keys[key], time_s)

    def _hold(self, step: Hold) -> None:
        if self._past:
            return  # the log holds the trial: nobody need look at it again
        holding = self.presenter.hold(step.scene, step.seconds)
        self._end_holding(holding.onset_s)
        self._holding = step.what, holding

    def _end_holding(self, next_onset_s: float) -> None:
        if self._holding is None:
            return
        what, holding = self._holding
        self._holding = None
        self._timed.append(
            {
                "what": what,
                "frames": holding.frames,
                "asked_ms": round(1000 * holding.frames * holding.period_s, 3),
                "shown_ms": round(1000 * (next_onset_s - holding.onset_s), 3),
                "missed_frames": holding.missed(next_onset_s),
            }
        )

    def _live(self, ask: Ask) -> tuple[str, float]:
        while True:
            onset_s = self.presenter.show(ask.scene)
            self._end_holding(onset_s)
            if ask.upcoming:
                self.presenter.prefetch(ask.upcoming)
            press = self.observer.respond(ask, onset_s)
            if press.key in ask.keys:
                return press.key, round(press.time_s - onset_s, 6)
            if press.key == "escape":
                answer = self.observer.respond(LEAVE, self.presenter.show(LEAVE.scene))
                if LEAVE.keys.get(answer.key) == "leave":
                    raise Left

    def _record(self, block: int, number: int, draft: Draft) -> None:
        data = {**draft.data, **self.marks}
        if draft.stimuli and self.clip_costs:
            data["clipping"] = {name: self.clip_costs[name] for name in draft.stimuli}
        if self._timed:
            data["timed"] = self._timed
        trial = Trial(block, number, draft.kind, tuple(self._events), draft.response_time_s, self.utc(), data)
        self._events, self._timed = [], []
        if self._past:
            self._compare(self._past.popleft(), trial)
            self._load_past_events()
        else:
            self.sink.append(trial)
        self.on_trial(trial)

    def _compare(self, logged: Trial, replayed: Trial) -> None:
        def identity(trial: Trial) -> tuple[Any, ...]:
            data = {key: value for key, value in trial.data.items() if key not in ("clipping", "timed")}
            return (trial.block, trial.trial, trial.kind, data)

        if identity(logged) != identity(replayed):
            raise SessionError(
                Finding(
                    f"the log's trial {logged.trial} of block {logged.block} is not the one the experiment now asks",
                    remedy="the experiment was changed: start a new session",
                )
            )

    def _load_past_events(self) -> None:
        self._past_events = deque(self._past[0].events if self._past else ())
