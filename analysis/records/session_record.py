"""The record of a session: one JSON object per line, in `session.jsonl`.

The first line is the header (``"record": "session"``), then follow one line per trial (``"record": "trial"``) in the
order of the answers and, once the session is complete, an end line (``"record": "end"``) with counts of the work
(frames drawn, missed, pictures uploaded). Between them may be notes (``"record": "note"``), marks of trials to repeat
(``"record": "mark"``), what became of the window (``"record": "window"``), a line for each time the session was resumed
(``"record": "resume"``), and before each batch of pairs that was chosen by the answers of all observers what was known
of these (``"record": "pool"``). A repeated trial is recorded again with a higher ``attempt``, and the last attempt
counts.

What the gamut clip costs a stimulus stands in the header if it was known when the session began, else in the trials
that show it or, if none does, in a line after the last trial of the last block (``"record": "clipping"``). Whoever
reads a log finds it in the header's ``stimuli`` all the same.

The reader defines the format; the runner writes it. Each line's last two keys are its number and its checksum
(`documents.files.chain`), the end line also states how many ``lines`` are before it, and the header that the log is
``chained``; older logs have none of the four.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from analysis.errors import ResultsError
from analysis.kinds.fields import HalfCharacterError, RecordError, of_whole_characters
from analysis.kinds.trial import Trial
from analysis.records.lines import Header, Mark, Note, Resumption, SharedParts, Stimulus, WindowEvent
from documents import Finding, count_work
from documents.files import MOST_LOG_BYTES, RESTORE, DamagedLineError, LogState, open_regular, read_lines, unreadable

if TYPE_CHECKING:  # the models of all records: only who reads a log needs them
    from analysis.records.order import LogOrder
    from analysis.records.pooled_batches import PooledBatch

FILE_NAME = "session.jsonl"

Record = Trial | Note | Mark | Resumption
Kind = TypeVar("Kind", bound=Trial)
Line = TypeVar("Line", bound=Record)


@dataclass(frozen=True, slots=True)
class SessionLog:
    """The log of a session; ``answers`` holds every attempt in the order of the answers.

    ``records`` are answers, notes, marks and resumptions in the order of their lines, ``windows`` what became of the
    window, ``pooled`` the batches of pairs that were chosen by the answers of all observers.
    ``recorded_as`` is the observer's code in the log where the folder states another, which counts; else empty.
    """

    file: Path
    header: Header
    records: tuple[Record, ...]
    complete: bool
    state: LogState = field(default=LogState(), repr=False, compare=False)
    recorded_as: str = ""
    windows: tuple[WindowEvent, ...] = ()
    pooled: tuple[PooledBatch, ...] = ()
    # Gathered once: a report asks each session for its trials some thirty times.
    answers: tuple[Trial, ...] = field(init=False, repr=False, compare=False)
    _trials: tuple[Trial, ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "answers", self._those(Trial))
        object.__setattr__(self, "_trials", tuple({answer.place: answer for answer in self.answers}.values()))

    def _those(self, kind: type[Line]) -> tuple[Line, ...]:
        return tuple(record for record in self.records if isinstance(record, kind))

    @property
    def notes(self) -> tuple[Note, ...]:
        """The notes."""
        return self._those(Note)

    @property
    def marks(self) -> tuple[Mark, ...]:
        """The requests to repeat a trial."""
        return self._those(Mark)

    @property
    def resumptions(self) -> tuple[Resumption, ...]:
        """Each time that the session was resumed."""
        return self._those(Resumption)

    @property
    def software(self) -> tuple[dict[str, str], ...]:
        """The versions that wrote it: those at its start, then those of each time that it was resumed with others."""
        versions = [dict(self.header.software)]
        for resumption in self.resumptions:
            if resumption.software:
                versions.append(versions[-1] | resumption.software)
        return tuple(versions)

    @property
    def torn_tail(self) -> bytes:
        """The bytes of an unfinished last line, empty if there is none."""
        return self.state.torn_tail

    @property
    def chained_from(self) -> int | None:
        """The first line with a checksum: 1, a later one if an older version began the log, None if it wrote all."""
        return self.state.chained_from

    @property
    def trials(self) -> tuple[Trial, ...]:
        """The trials that count: each trial's last attempt, in the order of the first answers."""
        return self._trials

    def of(self, *kinds: type[Kind]) -> tuple[Kind, ...]:
        """Return those that count, without practice, whose records are of these ``kinds``."""
        return tuple(trial for trial in self._trials if isinstance(trial, kinds) and not trial.is_practice)

    @property
    def screened_out(self) -> bool:
        """Whether it ended at a test that the observer failed."""
        return any(trial.ends_session for trial in self._trials)

    @property
    def first_attempts(self) -> tuple[Trial, ...]:
        """The first attempt at each trial, from which a session is replayed."""
        return tuple(answer for answer in self.answers if answer.attempt == 0)

    @property
    def pending(self) -> tuple[tuple[int, int], ...]:
        """Block and trial of each mark without a further attempt, in the order of the marks."""
        attempts: dict[tuple[int, int], int] = {}
        for answer in self.answers:
            attempts[answer.place] = answer.attempt
        requests: dict[tuple[int, int], int] = {}
        for mark in self.marks:
            requests[mark.block, mark.trial] = requests.get((mark.block, mark.trial), 0) + 1
        return tuple(place for place, count in requests.items() if attempts.get(place, count) < count)


def session_files(folder: Path) -> Iterator[Path]:
    """Yield the session logs in ``folder`` and below it, sorted, or ``folder`` itself if it is such a file.

    Parameters
    ----------
    folder
        Folder of results, or one session log. A folder that does not exist has no logs.

    Yields
    ------
    Path
        Each file called ``session.jsonl``, sorted by path.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "01", FILE_NAME)
    ...     file.parent.mkdir()
    ...     file.touch()
    ...     [found.parent.name for found in session_files(Path(folder))]
    ['01']
    """
    if folder.is_file():
        yield folder
    else:
        yield from sorted(folder.rglob(FILE_NAME))


def read_session(file: Path, shared: SharedParts | None = None) -> SessionLog:
    """Read one session log.

    A last line that is incomplete, such as after a power cut, is left out and returned in ``torn_tail``. A last line
    that lacks only the line end counts.

    Parameters
    ----------
    file
        A ``session.jsonl``.
    shared
        What logs that were read before had, so that equal parts are one object.

    Returns
    -------
    SessionLog
        Header, trials, notes and marks.

    Raises
    ------
    ResultsError
        If the file is unreadable, is not a session log, is damaged before its last line, or was changed after it was
        recorded.

    Examples
    --------
    >>> import json
    >>> import tempfile
    >>> from analysis.records import new_header
    >>> header = new_header("views", "01", "s1", "2026-01-31T09:30:00Z", seed=1)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, FILE_NAME)
    ...     _ = file.write_text(json.dumps(header.to_json()) + "\\n")
    ...     log = read_session(file)
    >>> log.header.observer, log.complete
    ('01', False)
    """
    reader = RecordReader(shared := shared or SharedParts())
    try:
        with open_regular(file, "log", limit_bytes=MOST_LOG_BYTES, error=ResultsError) as stream:
            state = read_lines(stream, reader.take, on_checksum=reader.fits, repeated=shared.texts)
    except OSError as error:
        raise ResultsError(unreadable(error, file, "results")) from error
    except DamagedLineError as error:
        raise ResultsError(refusal(error, file)) from error
    if reader.header is None:
        raise ResultsError(Finding("the file has no session header", str(file), 1, 1, RESTORE))
    header, seen = reader.with_costs(reader.header), (tuple(reader.windows), tuple(reader.pooled))
    log = SessionLog(file, header, tuple(reader.records), reader.complete, state, "", *seen)
    count_work("sessions_read")
    count_work("trials_read", len(log.answers))
    return log


class RecordReader:
    """Takes the lines of a log one by one."""

    def __init__(self, shared: SharedParts | None = None) -> None:
        self._shared = shared or SharedParts()
        self.header: Header | None = None
        self.records: list[Record] = []
        self.windows: list[WindowEvent] = []
        self.pooled: list[PooledBatch] = []
        self._order: LogOrder | None = None
        self._fits = 0

    @property
    def complete(self) -> bool:
        """Whether the end was recorded."""
        return self._order is not None and self._order.complete

    def with_costs(self, header: Header) -> Header:
        """Return ``header`` with what the lines after it said of the stimuli's costs, where it does not say it."""
        cost_of = self._order.cost_of if self._order else lambda name: None
        stimuli = [
            stimulus.model_copy(update={"clipping": costs})
            if not stimulus.clipping and (costs := cost_of(stimulus.name))
            else stimulus
            for stimulus in header.stimuli
        ]
        return header.model_copy(update={"stimuli": stimuli})

    def fits(self, number: int) -> None:
        """Take note that the checksum of line ``number``, which is taken next, fits: it is as it was recorded."""
        self._fits = number

    def take(self, number: int, line: Any) -> None:
        """Take line ``number``; raise RecordError if it is not what can follow the lines before."""
        try:
            self._take(line, as_recorded=number == self._fits)
        except HalfCharacterError:
            self._take(of_whole_characters(line), as_recorded=number == self._fits)

    def _take(self, line: Any, *, as_recorded: bool) -> None:
        kind = line.get("record") if isinstance(line, dict) else None
        order = self._order
        if order is None:
            from analysis.records.order import LogOrder

            if kind != "session":
                raise RecordError("a session begins with its header")
            self._order = LogOrder(line, self._shared)
            self.header = self._order.header
        elif kind == "session":
            raise RecordError("a second header: the lines of another session follow")
        elif order.complete:
            raise RecordError("it follows the end of the session")
        elif kind == "trial":
            self.records.append(order.trial(line, as_recorded=as_recorded))
            if order.added and self.header is not None:
                further = (Stimulus(name=name) for name in order.added)
                self.header = self.header.model_copy(update={"stimuli": [*self.header.stimuli, *further]})
                order.added.clear()
        elif kind in ("note", "mark"):
            self.records.append(order.note(line) if kind == "note" else order.mark(line))
        elif kind == "resume":
            self.records.append(order.resumption(line))
        elif kind == "window":
            self.windows.append(order.window(line))
        elif kind == "clipping":
            order.clipping(line)
        elif kind == "pool":
            self.pooled.append(order.pool(line))
        elif kind == "end":
            order.end(line)
        else:
            from analysis.kinds.kinds import NEWER

            known = "session, trial, note, mark, resume, window, clipping, pool, end"
            raise RecordError(f"there is no record '{kind}' in this version, which has {known}", NEWER)


def refusal(error: DamagedLineError, file: Path) -> Finding:
    """Return the finding of a line of the log ``file`` that was refused."""
    cause = error.__cause__
    remedy = cause.remedy if isinstance(cause, RecordError) else None
    return error.finding(file, "this line is not a session record", remedy or RESTORE)
