"""The session engine: it drives the blocks, shows what they ask, and records what they draft.

A session that was stopped is resumed by replay: the same blocks are started under the same seed, and what the log
already holds is answered from it, without drawing, until the first trial that is not in the log. If a block drafts
another trial than the log holds, the session is refused rather than bent.

A trial is asked once more in the same way: its block is started again beside the first, replayed up to the trial, and
left after it. The answers that followed the first time stay what they were.
"""

from __future__ import annotations

import math
import threading
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

from analysis.kinds import Trial, new_trial
from analysis.records import Mark, Note, PooledBatch, SessionLog, WindowEvent
from documents import Finding
from runner.blocks.block import Block, Draft, SessionEnd
from runner.blocks.message import pause_menu
from runner.blocks.text_entry import typed
from runner.errors import SessionError, SessionStoppedError
from runner.ports import (
    MOST_IGNORED,
    AnyPresenter,
    Ask,
    ChooseBatch,
    Hold,
    Holding,
    Ignored,
    KeyPress,
    NoOthers,
    Observer,
    ObserverLeft,
    Pool,
    Response,
    WindowClosed,
)
from runner.scene import Scene
from runner.session.clocks import SteadyClock
from runner.session.events import (
    Answered,
    BlockBegan,
    Ended,
    Ending,
    Event,
    Listener,
    Paused,
    Record,
    Recorded,
    Recording,
    Replayed,
    SceneShown,
    Shown,
)
from runner.views.pages import page
from runner.views.style import FULL_HD_HALF, Style

Place = tuple[int, int]
RecordT = TypeVar("RecordT", bound=Record)


@dataclass(frozen=True, slots=True)
class Resumed:
    """What a session that is resumed has in its log, and the ``remedy`` if its blocks do not ask that.

    ``answers`` are all attempts; the trials at ``pending`` are to be asked once more.
    """

    answers: Sequence[Trial] = ()
    pending: Sequence[Place] = ()
    batches: Sequence[PooledBatch] = ()
    remedy: str = "the experiment or the log was changed since: restore it, or start a new session"

    @classmethod
    def of(cls, log: SessionLog, **remedy: str) -> Resumed:
        """Return what ``log`` holds."""
        return cls(log.answers, log.pending, log.pooled, **remedy)


@dataclass(slots=True)
class _RunState:
    """The state of a run: the answers still taken from the log, and what was done since the last record."""

    past: deque[Trial] = field(default_factory=deque)
    past_events: deque[tuple[str, float]] = field(default_factory=deque)
    events: list[tuple[str, float]] = field(default_factory=list)
    timed: list[dict[str, Any]] = field(default_factory=list)
    holding: tuple[str, Holding] | None = None
    interruptions: int = 0
    ignored: list[Ignored] = field(default_factory=list)
    ignored_more: int = 0
    window_lost: bool = False
    attempt: int = 0

    def ignore(self, press: KeyPress) -> None:
        """Keep what was ignored before ``press``, as much as a record has room for."""
        room = MOST_IGNORED - len(self.ignored)
        self.ignored += press.ignored[:room]
        self.ignored_more += press.ignored_more + len(press.ignored[room:])

    def load_events(self) -> None:
        self.past_events = deque(self.past[0].events if self.past else ())

    def taken(self, *, window_lost: bool) -> tuple[list[tuple[str, float]], dict[str, Any]]:
        """Return the presses and what else the next record says of what was done, which begins anew."""
        said = {
            "timed": self.timed,
            "interruptions": self.interruptions,
            "ignored": [[press.key, press.from_onset_s, press.why] for press in self.ignored],
            "ignored_more": self.ignored_more,
            "window_lost": self.window_lost,
        }
        events, self.events, self.timed, self.ignored = self.events, [], [], []
        self.interruptions, self.ignored_more, self.window_lost = 0, 0, window_lost
        return events, {name: fact for name, fact in said.items() if fact}


@dataclass(slots=True)
class Session:
    """One observer's run through the blocks.

    ``log`` hears each event first, and has a record on disk when it returns; then the ``listeners`` hear it, and then
    the ``guests`` (see `runner.session.events`). ``before`` is what the log of a session that is resumed holds;
    ``least_s`` has each block's least response time. Whoever shows the scenes calls `onset` right after each swap.
    ``pool`` knows the answers of all observers, where a block chooses by these. ``answers`` are all attempts that the
    log holds.
    """

    blocks: Sequence[Block]
    presenter: AnyPresenter
    observer: Observer
    log: Listener
    before: Resumed = Resumed()
    least_s: Sequence[float] = ()
    utc: Callable[[], str] = field(default_factory=SteadyClock)
    style: Style = FULL_HD_HALF
    pool: Pool = field(default_factory=NoOthers)
    listeners: list[Listener] = field(default_factory=list)
    guests: list[Listener] = field(default_factory=list)
    screened_out: bool = field(init=False, default=False)
    answers: list[Trial] = field(init=False)
    _shown_s: float = field(init=False, default=-math.inf)
    _pressed_s: float = field(init=False, default=-math.inf)
    _state: _RunState = field(init=False)
    _marked: list[Place] = field(init=False)
    _latest: Place | None = field(init=False, default=None)
    _place: Place = field(init=False, default=(0, 0))
    _batches: dict[Place, PooledBatch] = field(init=False)
    _away: set[str] = field(init=False, default_factory=set)
    # What of a block is being shown: a timed scene's name, empty for a question, None for a menu or the last page.
    _showing: str | None = field(init=False, default=None)
    _stimuli: tuple[str, ...] = field(init=False, default=())
    # Records are stamped and written one after the other, so that their times rise however slow the disk is.
    _writing: threading.RLock = field(init=False, default_factory=threading.RLock)

    def __post_init__(self) -> None:
        self.answers = list(self.before.answers)
        self._state = _RunState(deque(answer for answer in self.answers if answer.attempt == 0))
        self._marked = list(self.before.pending)
        self._batches = {batch.place: batch for batch in self.before.batches}

    def tell(self, event: Event) -> None:
        """Send ``event`` to the log, then to the listeners, and then to guests, if it has happened."""
        self.log.hear(event)
        if isinstance(event, Recorded) and isinstance(event.record, Trial):
            self.answers.append(event.record)
            self._latest = event.record.place if event.repeatable else self._latest
        for listener in self.listeners:
            listener.hear(event)
        for guest in () if isinstance(event, Recording | Ending) else tuple(self.guests):
            try:
                guest.hear(event)
            except (SessionStoppedError, ObserverLeft, WindowClosed):
                raise
            except Exception as error:
                self.guests.remove(guest)
                self.note(f"{type(guest).__name__}, a listener, failed and hears nothing more: {error!r}", "program")

    def record(self, made: Callable[[str], RecordT], *, repeatable: bool = False) -> RecordT:
        """Record what ``made`` returns for the time now, and return it; from any thread."""
        with self._writing:
            record = made(self.utc())
            self.tell(Recorded(record, repeatable))
        return record

    def run(self) -> None:
        """Run to the end, or to where a block ends the session, and record that.

        Raises
        ------
        ObserverLeft
            If the observer left; everything answered is recorded.
        WindowClosed
            If the window was closed.
        SessionError
            If the log does not fit the blocks.
        """
        self._state.load_events()
        ended: dict[str, Any] = {}
        try:
            for number, block in enumerate(self.blocks):
                self._run_block(number, block)
                self._repeat_marked(number)
        except SessionEnd as end:
            ended = end.facts
        if self._state.past:
            what = f"the log has {len(self._state.past)} more trials than the experiment"
            raise SessionError(Finding(what, remedy=self.before.remedy))
        while self._marked and not ended:  # marked when their block was over
            self._repeat(self._marked[0])
        ending = Ending()
        self.tell(ending)
        self.tell(Ended({**ending.facts, **ended}))
        self.screened_out = bool(ended.get("screened_out"))

    def show_end_page(self, words: str) -> None:
        """Show ``words`` until someone goes on; nothing is recorded, and the session is complete before."""
        ask = self.style.interface.listening(page(words, self.style, "finish"))
        with suppress(WindowClosed, KeyboardInterrupt):
            self._show_and_wait(ask)

    def note(self, words: str, by: str) -> None:
        """Record a note, with its place in the session; from any thread."""
        self.record(lambda utc: Note(text=words, by=by, block=self._place[0], trial=self._place[1], utc=utc))

    def window(self, what: str, facts: Mapping[str, Any]) -> None:
        """Record what became of the window, and with the trial that it was away."""
        self._away -= {opposite for opposite, of in _OPPOSITES.items() if of == what}
        if what in _OPPOSITES:
            self._away.add(what)
            self._state.window_lost = True
        self.record(lambda utc: WindowEvent(what=what, block=self._place[0], trial=self._place[1], utc=utc, **facts))

    def onset(self, onset_s: float) -> None:
        """Tell of an onset, unless it is of a menu or the page at the end."""
        if self._showing is not None:
            self.tell(SceneShown(self._shown(), onset_s))

    def _shown(self) -> Shown:
        block, trial = self._place
        return Shown(block, trial, self._state.attempt, self._showing or "", self._stimuli, len(self.answers))

    def mark(self, by: str) -> Place | None:
        """Mark the last answered trial to be asked once more after its block, or at the end if that is over.

        Return its place; None if no trial was answered that could be, or it is marked already. From any thread.
        """
        place = self._latest
        if place is None or place in self._marked:
            return None
        self.record(lambda utc: Mark(block=place[0], trial=place[1], by=by, utc=utc))
        self._marked.append(place)
        return place

    def _run_block(self, number: int, block: Block, only: int | None = None) -> None:
        """Run ``block``, or of it until the trial ``only`` is recorded."""
        steps = block.steps()
        response: Response | PooledBatch | None = None
        trial = 0
        self._place = number, trial
        if not self._state.past:
            self.tell(BlockBegan(number))
        while True:
            self._place = number, trial
            try:
                step = steps.send(response)
            except StopIteration:
                return
            response = None
            if isinstance(step, Draft):
                self._record(number, trial, step)
                if trial == only:
                    steps.close()
                    return
                trial += 1
            elif isinstance(step, ChooseBatch):
                response = self._choose(step)
            elif isinstance(step, Hold):
                self._hold(replace(step, scene=self._with_progress(step.scene)))
            else:
                response = self._respond(self._as_asked(step))

    def _choose(self, step: ChooseBatch) -> PooledBatch:
        """Return the batch that the log holds, or else let it be chosen and record it before its first trial."""
        batch = self._batches.get(self._place)
        if batch is None:
            block, trial = self._place
            if self._state.past:
                what = f"the log does not say which pairs were chosen at trial {trial} of block {block}"
                raise SessionError(Finding(what, remedy=self.before.remedy))
            chosen = self.pool.batch(block, trial, step)
            batch = self.record(lambda utc: chosen.model_copy(update={"block": block, "trial": trial, "utc": utc}))
            self._batches[self._place] = batch
        elif not set(batch.stimuli) <= set(step.stimuli):
            what = f"the log's pairs at trial {self._place[1]} of block {self._place[0]} are of other stimuli"
            raise SessionError(Finding(what, remedy=self.before.remedy))
        return batch

    def _as_asked(self, ask: Ask) -> Ask:
        """Return ``ask`` with the experiment's keys, and with the progress if it is wanted."""
        ask, scene = self.style.interface.listening(ask), self._with_progress(ask.scene)
        return ask if scene is ask.scene else replace(ask, scene=scene)

    def _with_progress(self, scene: Scene) -> Scene:
        number, trial = self._place
        if self.style.progress == "none" or not self.blocks[number].trials:
            return scene
        counts = [block.trials for block in self.blocks]
        return self.style.with_progress(scene, sum(counts[:number]) + min(trial, counts[number]), sum(counts))

    def _respond(self, ask: Ask) -> Response:
        state = self._state
        if state.past_events:
            key, time_s = state.past_events.popleft()
        else:
            key, time_s = self._live(ask)
        meaning = ask.meaning(key)
        if meaning is None:
            what = f"the log has the key '{key}' where only {sorted(ask.keys)} can be pressed"
            raise SessionError(Finding(what, remedy=self.before.remedy) if state.past else what)
        state.events.append((key, time_s))
        return Response(key, meaning, time_s)

    def _hold(self, step: Hold) -> None:
        if self._state.past:
            return  # the log holds the trial: nobody need look at it again
        self._showing, self._stimuli = step.what, step.scene.stimuli
        holding = self.presenter.hold(step.scene, step.seconds)
        self._end_holding(holding.onset_s)
        self._state.holding = step.what, holding

    def _end_holding(self, next_onset_s: float) -> None:
        if self._state.holding is None:
            return
        what, holding = self._state.holding
        self._state.holding = None
        self._state.timed.append(
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
            press, onset_s = self._show_and_wait(ask, of_block=True)
            if ask.meaning(press.key) is not None:
                self.tell(Answered(self._shown(), press.time_s))
                return press.key, round(press.time_s - onset_s, 6)
            if press.key == "escape":
                self._state.interruptions += 1
                self._pause()

    def _show_and_wait(self, ask: Ask, *, of_block: bool = False) -> tuple[KeyPress, float]:
        self._showing, self._stimuli = "" if of_block else None, ask.scene.stimuli
        shown_s = self.presenter.show(ask.scene)
        self._end_holding(shown_s)
        # Of a scene that stands already, the question begins where the last answer was given.
        onset_s = max(shown_s, self._pressed_s) if shown_s == self._shown_s else shown_s
        self._shown_s = shown_s
        if ask.upcoming:
            self.presenter.prefetch(ask.upcoming)
        if self.least_s:
            ask = replace(ask, least_s=self.least_s[self._place[0]])
        press = self.observer.respond(ask, onset_s)
        self._state.ignore(press)
        self._pressed_s = press.time_s
        return press, onset_s

    def _pause(self) -> None:
        self.tell(Paused(*self._place))
        while True:
            can_repeat = self._latest is not None and self._state.attempt == 0
            menu = self.style.interface.listening(pause_menu(self.style, can_repeat=can_repeat))
            meaning = menu.meaning(self._show_and_wait(menu)[0].key)
            if meaning == "stop":
                raise ObserverLeft
            if meaning == "note":
                self._take_note()
            elif meaning == "repeat":
                self.mark("observer")
                if self._latest is not None:
                    self._repeat(self._latest)
                return
            else:
                return

    def _take_note(self) -> None:
        """Let a note be typed; Escape cancels it."""
        writing = typed(self.style.say("note"), self.style, name="note", required=False)
        response: Response | None = None
        while True:
            try:
                ask = writing.send(response)
            except StopIteration as written:
                words, _ = written.value
                if words:
                    self.note(words, "observer")
                return
            press, onset_s = self._show_and_wait(ask)
            meaning = ask.meaning(press.key)
            if meaning is None:
                return
            response = Response(press.key, meaning, press.time_s - onset_s)

    def _repeat_marked(self, block: int) -> None:
        while places := [place for place in self._marked if place[0] == block]:
            self._repeat(places[0])

    def _repeat(self, place: Place) -> None:
        """Ask the trial at ``place`` once more."""
        block, trial = place
        first = [answer for answer in self.answers if answer.block == block and answer.attempt == 0]
        kept, kept_place = self._state, self._place
        attempt = sum(answer.place == place for answer in self.answers)
        self._state = _RunState(deque(first[:trial]), attempt=attempt, window_lost=bool(self._away))
        self._state.load_events()
        try:
            self._run_block(block, self.blocks[block], only=trial)
        finally:
            self._state, self._place = kept, kept_place
        if place in self._marked:
            self._marked.remove(place)

    def _record(self, block: int, number: int, draft: Draft) -> None:
        state = self._state
        events, done = state.taken(window_lost=bool(self._away))

        def trial(utc: str, more: Mapping[str, Any], attempt: int = 0) -> Trial:
            data = {**draft.data, **more, **done}
            return new_trial(block, number, draft.kind, events, draft.response_time_s, utc, data, attempt)

        if not state.past:
            recording = Recording(state.attempt, draft.stimuli)
            self.tell(recording)
            self.record(lambda utc: trial(utc, recording.data, state.attempt), repeatable=draft.repeatable)
            return
        replayed = trial(state.past[0].utc, {})
        self._compare(state.past.popleft(), replayed)
        state.load_events()
        if not state.attempt:
            self._latest = replayed.place if draft.repeatable else self._latest
            self.tell(Replayed(replayed, len(state.past)))

    def _compare(self, logged: Trial, replayed: Trial) -> None:
        if _identity(logged) != _identity(replayed):
            raise SessionError(
                Finding(
                    f"the log's trial {logged.trial} of block {logged.block} is not the one the experiment now asks",
                    remedy=self.before.remedy,
                )
            )


_OPPOSITES = {"lost_focus": "got_focus", "minimised": "restored"}
_CIRCUMSTANCES = frozenset(
    ("clipping", "timed", "interruptions", "ignored", "ignored_more", "window_lost", "timing_marks")
    + ("nominal", "uncharacterised", "wrong_screen")
    + ("rating_times_s",)  # older versions counted otherwise what was pressed without effect
)


def _identity(trial: Trial) -> tuple[Any, ...]:
    """Return what a replay must reproduce."""
    return trial.block, trial.trial, trial.kind, {k: v for k, v in trial.details().items() if k not in _CIRCUMSTANCES}
