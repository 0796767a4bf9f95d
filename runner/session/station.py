"""A station: an experiment with its stimuli built and its presenter open, where observers sit down one by one."""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass, field, replace
from datetime import datetime
from importlib.metadata import version
from pathlib import Path
from types import TracebackType
from typing import Any

from analysis.records import Header, SessionLog, configuration_folder, duration, latest_utc, read_utc
from devices.display import EYES
from documents import Finding
from documents.files import RESTORE
from documents.fonts import undrawable
from documents.text import counted
from runner.blocks.block import Block, Draft
from runner.blocks.context import Draw
from runner.errors import SessionError, SessionStoppedError
from runner.observers.observer_file import ImageBasedObserverSpec, ObserverSpec
from runner.observers.presses import Replay, asked_after_their_block, changes, check_replayable
from runner.observers.simulated import BradleyTerryObserver, mean_delta_e_00, walk
from runner.ports import NoOthers, Observer, Pool
from runner.presenter.errors import GraphicsError
from runner.presenter.gamma_check import (
    REMEDY,
    GammaWatch,
    change_of_table,
    compare_tables,
    table_of_record,
    tables_json,
)
from runner.presenter.presenter import Presenter
from runner.presenter.surfaces.opening import open_surface
from runner.presenter.surfaces.surface import Surface
from runner.protocol.experiment import Experiment, check_observer
from runner.scene import Picture, Scene
from runner.session.clipping_costs import ClippingCosts, CostWork
from runner.session.clocks import Pace, PacedPresenter, SteadyClock
from runner.session.configuration import Configuration, configuration_of
from runner.session.costs_in_turn import CostsInTurn, RecordedCosts
from runner.session.earlier import version_now
from runner.session.events import BlockBegan, Ending, Event, Recording, SessionBegan
from runner.session.folders import (
    LogMirror,
    Recorder,
    new_label,
    next_sitting,
    observer_folder,
    refuse_mirror_within,
    start_mirror,
)
from runner.session.header import check_unchanged, hashes, make_header, planned
from runner.session.options import SessionOptions
from runner.session.picture_source import PictureSource
from runner.session.pooling import RecordedPool, ResultsPool, pooled_blocks
from runner.session.rig_part import RigPart, parts_of
from runner.session.session import Resumed, Session
from runner.session.status import SessionStatus
from runner.session.timing_record import timing_facts
from stimuli.build import StimulusSet

_CLOCK_NOTED_S = 10.0  # less comes about where a clock is kept right while a session runs
_ANOTHER_DAY_S = 12 * 3600.0
TIMED_S = 1.0  # how long swaps are timed before a session
_UNCHARACTERISED = (
    "the display was not characterised in the mode '{mode}': colours are those of '{other}' and not to be trusted"
)


@dataclass(slots=True)
class Station:
    """Use as a context manager; ``presenter`` and ``surface`` are closed with it."""

    experiment: Experiment
    stimuli: StimulusSet
    options: SessionOptions
    surface: Surface
    presenter: Presenter
    pictures: PictureSource
    costs: CostsInTurn
    remarks: tuple[str, ...]
    timing: dict[str, Any]
    cost_work: CostWork
    watch: GammaWatch
    configuration: Configuration
    parts: tuple[RigPart, ...] = ()  # of the rig, such as what sends its timing marks, where they are sent
    pool: ResultsPool | None = None  # where a block chooses its pairs by the answers of all observers
    recorder: Recorder | None = None  # of the session that runs, or ran last, as those below
    status: SessionStatus = field(default_factory=SessionStatus)
    mirror: LogMirror | None = None
    resume_remarks: tuple[str, ...] = ()  # on the clock, where that session was resumed

    @classmethod
    def open(cls, experiment: Experiment, stimuli: StimulusSet, options: SessionOptions) -> Station:
        """Open the surface and the presenter in the rig's stereo mode and its parts, as ``options`` say.

        Raises
        ------
        InputError
            If the surface cannot be opened or cannot do the mode, or, unless ``accept_gamma_table``, the gamma table
            that is loaded is not the one that the display was measured with, or, unless ``wrong_screen``, the rig's
            panel is larger than the screen, or if a part such as a port of the rig's timing marks cannot be opened.
        """
        rig = experiment.rig
        mode = experiment.mode
        if rig.mirror:
            refuse_mirror_within(options.folder, rig.mirror, rig.file)
        further = (Path(options.simulate),) if options.simulate else ()
        configuration = configuration_of(experiment, stimuli, further)
        pictures = PictureSource(experiment, stimuli)
        costs = ClippingCosts.of(experiment, stimuli, pictures.stimulus)
        correction = costs.compensation.correction
        with ExitStack() as undo:
            parts = parts_of(rig) if options.sends_marks else ()
            for part in parts:
                undo.callback(part.close)
                part.prepare(options.notify)
            surface = open_surface(
                options.surface,
                rig.display.panel.resolution_px,
                stereo=mode.needs_stereo,
                windowed=options.windowed,
                windows=mode.windows,
                bits=rig.output_bits,
                identity=rig.spec.gamma_table == "identity",
                monitors=rig.monitors,
                refuse_larger=not options.wrong_screen,
            )
            undo.callback(surface.close)
            experiment = replace(experiment, keyboard_labels=_drawable_labels(surface, experiment))
            watch = GammaWatch(surface.gamma_tables)
            verdict = compare_tables(rig.measured_gamma_tables, watch.loaded)
            if verdict.refusal and not options.accept_gamma_table:
                raise SessionError(Finding(verdict.refusal, rig.file, remedy=REMEDY))
            presenter = Presenter(
                surface,
                mode,
                rig.models,
                pictures.load,
                dithering=experiment.dithering,
                correction=correction,
                ground=experiment.ground,
            )
            in_turn = CostsInTurn(costs)
            pictures.on_read = in_turn.was_read
            undo.pop_all()
        timing, timing_remarks = timing_facts(presenter, TIMED_S, rig.verification)
        remarks = surface.facts.remarks + timing_remarks + tuple(filter(None, (verdict.refusal, verdict.warning)))
        if rig.nominal:
            remarks += (rig.nominal.remark,)
        elif not rig.is_characterised:
            remarks += (_UNCHARACTERISED.format(mode=rig.mode, other=rig.characterised_as),)
        remarks += rig.settings_doubts
        remarks += tuple(remark for part in parts for remark in part.remarks())
        if rig.marks and options.marks is False:
            remarks += ("the rig's timing marks were not sent (--no-marks)",)
        pool = ResultsPool(experiment, options.folder) if pooled_blocks(experiment) else None
        return cls(
            *(experiment, stimuli, options, surface, presenter, pictures, in_turn, remarks, timing),
            *(costs.work, watch, configuration, parts, pool),
        )

    def __enter__(self) -> Station:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.costs.end()
        for part in self.parts:
            part.close()
        self.presenter.close()
        self.surface.close()
        self.end_mirror()

    def simulated(self, spec: ObserverSpec, observer: str, seed: int | None = None) -> Observer:
        """Return a simulated observer whose answers are drawn from ``seed``, or the experiment's, and its own name."""
        rng = random.Random(
            f"{self.experiment.spec.seed if seed is None else seed}/{self.experiment.spec.name}/simulated/{observer}"
        )
        if isinstance(spec, ImageBasedObserverSpec):
            reference = spec.reference or self.experiment.stimuli.reference
            if reference is None:
                raise SessionError("an image-based observer needs a reference picture")
            far = mean_delta_e_00(self.pictures.stimulus, self.stimuli.names, reference, self.experiment.rig.models)
            log_scores = {name: -spec.slope_per_delta_e_00 * distance for name, distance in far.items()}
            return BradleyTerryObserver.by_log_scores(log_scores, rng, spec)
        return BradleyTerryObserver(spec.scores, rng, spec.median_response_time_s, spec)

    def replay(self, log: SessionLog, observer: str) -> Path:
        """Run ``observer``'s recorded session again as it went, without waiting, and return the new session's folder.

        Raises
        ------
        WindowClosed
            If the recorded session was never finished, where it stopped.
        InputError
            If it was of another experiment or observer, or, unless these are accepted, something changed since.
        """
        now = hashes(self.experiment, self.stimuli)
        accepted = self.options.accept_changes
        remarks = check_replayable(log, self.experiment.spec.name, observer, now, accept_changes=accepted)
        return self.run(observer, Replay.of(log), simulated=True, remarks=remarks, replayed=log)

    def run(
        self,
        observer: str,
        answers: Observer,
        *,
        simulated: bool = False,
        resume: SessionLog | None = None,
        replayed: SessionLog | None = None,
        remarks: tuple[str, ...] = (),
    ) -> Path:
        """Run one observer's session to its end and return its folder.

        ``resume`` is the log of the session that stopped, as it was read; None begins a new one, whose record has
        ``remarks`` beside the station's own. ``replayed`` is the log whose order and batches of pairs are taken, where
        these are not drawn.

        Raises
        ------
        ObserverLeft, WindowClosed
            If the observer left; what was answered is on disk.
        GraphicsError
            If the driver failed or lost the context; what was answered is on disk, and a note says why it stopped.
        SessionStoppedError
            If the gamma table changed and that is not accepted; what was answered before is on disk, and a note says
            what changed.
        InputError
            If the session cannot begin, as where pairs are to be chosen by the answers in the results folder and some
            are of another experiment, or be resumed: where changes are accepted it is resumed although the experiment,
            the stimuli or the display changed, as long as the trials answered so far are still those asked.
        """
        check_observer(observer)
        blocks, draw = self._blocks(observer, resume or replayed, simulated=simulated)
        if not (simulated or resume) and (first := _first_with_pictures(blocks)):
            self.presenter.prefetch(first, at_once=True)
        if self.pool and not replayed:
            self.pool.simulated = simulated
            self.pool.look()
            if not resume:
                self.pool.refuse_foreign()
        before = Resumed(pending=asked_after_their_block(replayed)) if replayed else Resumed()
        if resume:
            recorder, log, clock = self._resume(resume)
            header, before = log.header, Resumed.of(log, remedy=self._why_not_as_logged(log))
        else:
            clock = SteadyClock()
            recorder, header = self._begin(observer, simulated, remarks, clock, blocks, draw)
        self.recorder = recorder
        if not simulated:
            self._read_meanwhile()
        pool: Pool = (RecordedPool(replayed) if replayed else None) or self.pool or NoOthers()
        with recorder:
            session = Session(
                blocks,
                PacedPresenter(
                    self.presenter,
                    self._pace(instantly=simulated),
                    self.costs.pause,
                    self.costs.resume,
                    on_onset=lambda onset_s: session.onset(onset_s),
                ),
                answers,
                recorder,
                before,
                least_s=[spec.least_s for spec in self.experiment.spec.blocks],
                utc=clock,
                style=self.experiment.style,
                pool=pool,
            )
            self._listen(session, recorder, header, clock)
            self.surface.on_window = session.window
            try:
                session.run()
            except GraphicsError as error:
                session.note(f"the session stopped: {error}", "program")
                raise
            finally:
                self.costs.end()
                self.surface.on_window = None
        if self.experiment.end_page and not simulated and not session.screened_out:
            session.show_end_page(self.experiment.end_page)  # all is on disk, and the log is closed
            recorder.check()
        return recorder.folder

    def _blocks(self, observer: str, earlier: SessionLog | None, *, simulated: bool) -> tuple[tuple[Block, ...], Draw]:
        """Return the blocks as the ``earlier`` session met them, or as the observer's next one does."""
        if earlier:
            draw = Draw(earlier.header.order_rule, earlier.header.sitting)
        else:
            name = self.experiment.spec.name
            draw = Draw(sitting=next_sitting(self.options.folder, name, observer, simulated=simulated))
        blocks = self.experiment.blocks(observer, draw)
        self.pictures.add(blocks)
        return blocks, draw

    def _listen(self, session: Session, recorder: Recorder, header: Header, clock: SteadyClock) -> None:
        """Add all that listens to ``session`` beside its log, and tell them that it begins."""
        start = read_utc(header.started_utc) or datetime.fromisoformat(clock())
        factors = {name: self.stimuli.factors(name) for name in self.stimuli.names}
        kinds = (spec.kind for spec in self.experiment.spec.blocks)
        blocks = [(kind, one.trials, one.expected_s) for kind, one in zip(kinds, session.blocks, strict=True)]
        self.status = SessionStatus()
        session.listeners += [
            RecordedCosts(self.costs, session, header),
            _Conditions(self, session),
            *(part.listener(lambda: clock.since(start), factors, session.note) for part in self.parts),
            self.status,
        ]
        for remark in self.resume_remarks:
            session.note(remark, "program")
            self.options.notify(f"warning: {remark}")
        if self.pool:
            self.pool.own = header.session
            self.pool.note = lambda words: session.note(words, "program")
        self.end_mirror()
        if folder := self.experiment.rig.mirror:
            self.mirror = start_mirror(recorder, folder, session.note)
            session.listeners.append(self.mirror)
        session.guests += self.options.listeners
        counters = self.presenter.counters
        session.tell(SessionBegan(session, blocks, lambda: counters.frames_missed))

    def _read_meanwhile(self) -> None:
        """Make the pictures ready while the observer looks at what is shown, and compute what the cache has not."""
        self.costs.begin(self.surface.wake)
        places = self.experiment.places_px if self.presenter.codes_depend_on_place else ((0, 0),)
        scenes = (Scene(tuple(Picture(name, place) for place in places)) for name in self.stimuli.names)
        self.presenter.prefetch_later(scenes, lambda: not self.costs.is_busy)

    def configuration_again(self) -> str | None:
        """Write again what another program removed or changed of the files kept beside the session; say which.

        Raises
        ------
        SessionError
            If they cannot be written.
        """
        if self.recorder is None:
            return None
        folder = self.recorder.folder.parents[1]
        written = self.configuration.keep(folder)
        if not written:
            return None
        place = configuration_folder(folder, self.configuration.digest)
        files = f"{counted(len(written), 'file', 'files')} of the session's configuration, such as {written[0]}"
        return f"{place}: another program removed or changed {files}; written again"

    def end_mirror(self) -> str | None:
        """Let the copy of the last session's log be completed, for some seconds; return what is wrong with it."""
        mirror, self.mirror = self.mirror, None
        return mirror.close() if mirror else None

    @property
    def gamma_may_change(self) -> bool:
        """Whether another gamma table is noted only: where that is accepted, and on a display that nobody measured."""
        return self.options.accept_gamma_table or self.experiment.rig.nominal is not None

    @property
    def stamps(self) -> dict[str, Any]:
        """What every trial's record says of how it was shown."""
        larger = {"wrong_screen": True} if self.surface.facts.larger_than_screen else {}
        return {**self.experiment.rig.stamps, **larger}

    @property
    def work(self) -> dict[str, int]:
        """What was done since the station was opened, by name, as the log's last line has it."""
        work = asdict(self.presenter.counters) | asdict(self.cost_work)
        return work | {"gamma_table_reads": self.watch.reads}

    def _pace(self, *, instantly: bool) -> Pace:
        refresh_hz = self.surface.facts.refresh_hz or self.experiment.rig.display.panel.refresh_hz
        measured_ms = self.timing.get("swap_intervals", {}).get("median_ms", 0.0)
        return Pace(1.0 / refresh_hz, swaps_wait=measured_ms > 500.0 / refresh_hz, instantly=instantly)

    def _begin(
        self,
        observer: str,
        simulated: bool,
        remarks: tuple[str, ...],
        clock: SteadyClock,
        blocks: Sequence[Block],
        draw: Draw,
    ) -> tuple[Recorder, Header]:
        parent = observer_folder(self.options.folder, self.experiment.spec.name, observer)
        started_utc = clock()
        label = new_label(parent, datetime.fromisoformat(started_utc))
        drawn = {"planned": planned(self.experiment, blocks), "order_rule": draw.rule, "sitting": draw.sitting}
        header = self._header(observer, label, simulated, remarks, started_utc, **drawn)
        self.configuration.keep(parent.parent)
        return Recorder.create(parent / f"ses-{header.session}", header), header

    def _resume(self, stopped: SessionLog) -> tuple[Recorder, SessionLog, SteadyClock]:
        now = hashes(self.experiment, self.stimuli)
        if not self.options.accept_changes:
            check_unchanged(stopped, version_now(self.experiment, self.stimuli, self.configuration))
        self.resume_remarks = ()
        changed = changes(stopped.header, now) | self._gamma_change(stopped)
        if changed:
            changed |= changes(stopped.header, {"configuration": self.configuration.digest})
        self.configuration.keep(stopped.file.parents[2])
        recorder, log, clock = Recorder.resume(stopped.file.parent, changed, stopped)
        self.resume_remarks += tuple(_on_clock(log, clock))
        if left := recorder.log.taken_over:
            self.resume_remarks += (f"the process that wrote the session before ended without closing it: {left}",)
        return recorder, log, clock

    def _why_not_as_logged(self, log: SessionLog) -> str:
        """Say what to do if the experiment does not ask what ``log`` has: which of both was changed."""
        changed = changes(log.header, hashes(self.experiment, self.stimuli))
        if changed:
            return f"the {' and the '.join(changed)} changed since: restore what it began with, or start a new session"
        recorded_by, here = log.header.software.get("cyclopean"), version("cyclopean")
        if recorded_by is not None and recorded_by != here:
            return f"version {recorded_by} of cyclopean began it and this is {here}: resume it with that version"
        return f"the experiment is as it was, so the log was changed: {RESTORE}"

    def _gamma_change(self, stopped: SessionLog) -> dict[str, dict[str, str | None]]:
        """Return the hash of the gamma table before and now if it changed; refuse that unless it is accepted."""
        held = stopped.header.presentation.gamma_table.loaded
        if not held:
            return {}
        for eye in EYES:
            before, now = table_of_record(held, eye), self.watch.loaded[eye]
            if now.monitor and before.same_as(now.table) is False:
                what = "this session began with another gamma table: " + change_of_table(before, now.table)
                if not self.gamma_may_change:
                    raise SessionError(Finding(what, str(stopped.file), remedy=REMEDY))
                self.resume_remarks += (f"{what} on '{now.monitor}'",)
                return {"gamma_table": {"before": before.sha256, "now": now.table.sha256}}
        return {}

    def _header(
        self, observer: str, session: str, simulated: bool, remarks: tuple[str, ...], started_utc: str, **drawn: Any
    ) -> Header:
        rig = self.experiment.rig
        gamma = {
            "measured": tables_json(rig.measured_gamma_tables),
            "loaded": tables_json(self.watch.loaded),
            "set": rig.spec.gamma_table if self.surface.facts.backend == "window" else None,
            "accepted": self.options.accept_gamma_table,
        }
        facts = self.surface.facts.to_json() | {"timing": self.timing, "gamma_table": gamma}
        if rig.mirror:
            facts["results_mirror"] = str(rig.mirror)
        if self.parts:
            facts["timing_marks"] = [fact for part in self.parts for fact in part.facts]
        return make_header(
            self.experiment,
            self.stimuli,
            observer,
            session,
            self.costs.stimuli,
            facts,
            simulated=simulated,
            remarks=self.remarks + remarks,
            started_utc=started_utc,
            configuration=self.configuration.digest,
            listen=self.options.listen,
            **drawn,
        )


@dataclass(frozen=True, slots=True)
class _Conditions:
    """Records how the station shows trials, and at the end what was done; watches the gamma table.

    That is looked at as a block begins and before an answer is recorded. A change is noted and, unless it is accepted,
    ends the session without that answer.
    """

    station: Station
    session: Session

    def hear(self, event: Event) -> None:
        match event:
            case BlockBegan():
                self._look(now=True)
            case Recording():
                self._look(now=False)
                event.data.update(self.station.stamps)
            case Ending():
                event.facts["work"] = self.station.work

    def _look(self, *, now: bool) -> None:
        if change := self.station.watch.change(now=now):
            self.session.note(change, "program")
            if not self.station.gamma_may_change:
                raise SessionStoppedError(f"{change}. Load that table again (docs/modes.md)")


def _drawable_labels(surface: Surface, experiment: Experiment) -> dict[str, str]:
    """Return what hints say of the keyboard's keys, as far as a font has the letters."""
    labels = surface.keyboard_labels()
    return {key: label for key, label in labels.items() if not undrawable(label, experiment.font)}


def _first_with_pictures(blocks: Sequence[Block]) -> Scene | None:
    """Return the first scene with a picture that a session shows."""
    steps = (step for block in blocks for step in walk(block))
    return next((step.scene for step in steps if not isinstance(step, Draft) and step.scene.stimuli), None)


def _on_clock(log: SessionLog, clock: SteadyClock) -> Iterator[str]:
    """Yield what a resumed session's record says of the clock where that was set back, or stands far ahead."""
    before, now = latest_utc(log), datetime.fromisoformat(clock())
    if clock.behind_s >= _CLOCK_NOTED_S:
        yield (
            f"the machine's clock stood {duration(clock.behind_s)} before the last record when the session was "
            "resumed: times count on from that record"
        )
    elif before and (gap_s := (now - before).total_seconds()) >= _ANOTHER_DAY_S:
        yield f"the session was resumed {duration(gap_s)} after its last record"
