"""What the record of every trial has, whatever its kind, and what can be said of one record by those before it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Annotated, Any, ClassVar, Literal, NamedTuple

from pydantic import ConfigDict, Field, Strict, model_validator

from analysis.kinds.fields import Count, Event, Fields, Name, Number, Seconds, Utc

PRACTICE = "practice"
NAMED = "The stimulus is described in the session's sidecar under Stimuli."
TIME, TIMES = "how long the answer took", "how long each rating took"
# Where, when and in which attempt: what begins the line of a trial of any kind.
PLACED = ("record", "block", "trial", "kind", "events", "response_time_s", "utc", "attempt")
# Times are rounded to 1e-6 s, and sums of them once more.
ROUNDING_S = 2e-6


class TimedScene(Fields):
    """A scene that stood for a given time, such as a fixation cross."""

    what: Name
    frames: Count
    asked_ms: Annotated[float, Field(ge=0, le=1e9)]
    shown_ms: Number
    missed_frames: Count


class TimingMark(Fields):
    """A mark to another machine: when it was sent, on the session's clock, or why it was not.

    ``after_ms`` counts from the onset or the press; of a simulated press, which is in the future, it is negative.
    ``scene`` names a timed scene, as in ``timed``; a question has none.
    """

    port: Name
    mark: Literal["onset", "answer"]
    code: Name | Count
    trial_byte: Count | None = None
    sent_s: Number | None = None
    after_ms: Number | None = None
    failed: Name | None = None
    scene: Name | None = None

    @model_validator(mode="after")
    def _sent_or_failed(self) -> TimingMark:
        if (self.sent_s is None) == (self.failed is None) or (self.sent_s is None) != (self.after_ms is None):
            raise ValueError("should have either 'sent_s' and 'after_ms' or 'failed'")
        return self


Ignored = Annotated[tuple[Name, Number, Name], Strict(False)]


Of = Literal["alone", "chosen", "both"]


class Rated(NamedTuple):
    """A rating on a ``scale``: ``of`` a stimulus that stood alone, that was chosen of two, or of both of these."""

    of: Of
    scale: str
    stimulus: str
    value: int


@dataclass(frozen=True, slots=True)
class ColumnWords:
    """What a column has in a table that is exported: a description, units, and what some of its values mean."""

    description: str
    units: str | None = None
    levels: Mapping[str, str] = field(default_factory=dict)


@dataclass(slots=True)
class SoFar:
    """What the records of a session so far say: what the next one must agree with.

    ``own_keys`` is whether the experiment gives keys other meanings; ``answers_of`` maps each key, where it was
    pressed in the same situation, to the answer that it gave; ``seen`` counts what a kind's own records count.
    """

    factors: Mapping[str, Mapping[str, Any]]
    own_keys: bool = False
    answers_of: dict[tuple[str, str], str] = field(default_factory=dict)
    seen: dict[Any, Any] = field(default_factory=dict)

    def forget(self) -> None:
        """Forget what a change of the experiment may change: factors, and what keys mean."""
        self.factors, self.own_keys = {}, True
        self.answers_of.clear()

    def key_means(self, situation: str, key: str, answer: str, usual: Mapping[str, str]) -> Iterator[str]:
        """Yield what is wrong if ``key`` gave ``answer``; ``usual`` is what keys mean if they have no other meaning."""
        if key.startswith("click "):
            known = key.removeprefix("click ")
        elif not self.own_keys and key in usual:
            known = usual[key]
        else:
            known = self.answers_of.setdefault((situation, key), answer)
        if known != answer:
            yield f"the answer is '{answer}', but the key '{key}' means '{known}'"


class Trial(Fields):
    """The fields of every trial. A kind adds its own, and says what must agree in them.

    What the program writes twice must agree in every log: `contradictions`. What can only be concluded from presses and
    times is compared by `pressed_otherwise`, and only where no checksum says that a line is as it was recorded.
    """

    model_config = ConfigDict(frozen=True)

    asked: ClassVar[tuple[str, ...]] = ()
    """The fields that say what was asked: the same in every attempt at a trial."""
    written: ClassVar[tuple[str, ...]] = ()
    """The kind's own fields that come first in a line, ``...`` for further ones; the others follow as declared."""
    heading: ClassVar[str] = ""
    """What the report's part on them is called; empty where there is none."""
    description: ClassVar[str] = ""
    """What a trial is, for tables that are exported."""
    not_reported: ClassVar[Mapping[str, str]] = {}
    """What the report does not show: fields, or with a dot those within one, and what each is."""
    report_part: ClassVar[str] = ""
    """The name of the report's part on them, in `cyclopean.report_parts`; empty where there is none."""
    did: ClassVar[str] = ""
    """What observers did, for Methods; {stimuli} is the number of stimuli."""
    counted_as: ClassVar[tuple[str, str]] = ("", "")
    """What Methods call a trial, and several; empty where they are not counted."""
    columns: ClassVar[Mapping[str, ColumnWords]] = {
        "stimulus": ColumnWords(f"Name of the stimulus that was shown. {NAMED}"),
        "level": ColumnWords(
            "Level of the factor, or of the test, at which the stimulus was shown; empty without a signal."
        ),
        "correct_answer": ColumnWords("The answer that would have been right."),
        "correct": ColumnWords("Whether the answer was right, for trials with a right answer."),
        "timed": ColumnWords(
            "For each timed scene of the trial: its name, the frames requested, its duration requested and shown in "
            "milliseconds, and the frames missed."
        ),
        "timing_marks": ColumnWords(
            "For each mark that another machine got: the port, whether it marks an onset or an answer, the code (on "
            "Lab Streaming Layer text of name=value with block and trial), when it was sent in seconds from the start "
            "of the session, and how many milliseconds after the onset or the press that was; or why it was not sent. "
            "The session's sidecar describes the ports (GraphicsSystem, timing_marks)."
        ),
        "uncharacterised": ColumnWords(
            "Whether the display was used in a stereo mode that had not been characterised."
        ),
        "nominal": ColumnWords(
            "The standard that the display was taken for: nominal, not measured. Empty where it was measured."
        ),
    }
    """Its columns in tables that are exported, and what is written of each; another kind's of that name have it too."""
    no_stimulus: ClassVar[tuple[str, ...]] = ("practice_of",)
    """The fields that name something else than a stimulus, which may be called as a stimulus is."""
    answers_task: ClassVar[bool] = True
    is_page: ClassVar[bool] = False
    """Whether it is a page of words."""
    is_outcome: ClassVar[bool] = False
    """Whether it states what came of a test, and is no answer."""
    ends_session: ClassVar[bool] = False
    """Whether the session ended with it, since the observer failed a test."""

    record: Literal["trial"]
    block: Count
    """The number of the block, from 0."""
    trial: Count
    """The number of the trial in its block, from 0."""
    kind: Name
    events: list[Event]
    """The presses since the record before: key, and seconds since the scene's onset."""
    response_time_s: Seconds
    """Seconds from the onset to the answer."""
    utc: Utc
    attempt: Count = 0
    """How often it had been answered before."""
    practice_of: Name | None = None
    """The kind that was practised, in a trial of practice."""
    nominal: Name | None = None
    uncharacterised: bool = False
    wrong_screen: bool = False
    """Whether a part of the panel was on no screen."""
    clipping: dict[str, Any] | None = None
    """What the clip cost each stimulus, where neither the header nor a trial before says it, or what it is since."""
    timed: Annotated[tuple[TimedScene, ...], Strict(False)] = ()
    interruptions: Count = 0
    """How often it was paused."""
    ignored: Annotated[tuple[Ignored, ...], Strict(False)] = ()
    """Presses that answered nothing: key, seconds from the onset, why."""
    ignored_more: Count = 0
    timing_marks: Annotated[tuple[TimingMark, ...], Strict(False)] = ()
    window_lost: bool = False

    @classmethod
    def of_line(cls, line: Mapping[str, Any]) -> type[Trial]:
        """Return the record of a line of the kind, of which there may be several."""
        return cls

    @property
    def place(self) -> tuple[int, int]:
        """Block and trial, the same for every attempt."""
        return self.block, self.trial

    @property
    def is_practice(self) -> bool:
        """Whether it is practice, which is not analysed."""
        return self.kind == PRACTICE

    @property
    def is_task(self) -> bool:
        """Whether it answers the task: no page, practice, question or vision test."""
        return self.answers_task and not self.is_practice

    @property
    def stimuli(self) -> tuple[str, ...]:
        """The stimuli that it names."""
        return ()

    @property
    def said(self) -> str:
        """What was answered, in words; empty where there is only a press."""
        return ""

    @property
    def unknown(self) -> tuple[str, ...]:
        """The names of fields that this version does not know: what a newer one adds."""
        return () if "..." in self.written else tuple(self.model_extra or ())

    def rated(self) -> Iterator[Rated]:
        """Yield what it gives to the ratings of stimuli."""
        yield from ()

    def to_json(self) -> dict[str, Any]:
        """Return the trial as a line's object, with its keys in the order in which they are written."""
        held = self.model_dump(mode="json", by_alias=True, exclude_unset=True, warnings=False)
        further = [key for key in held if key in (self.__pydantic_extra__ or ())]
        before, after = _order(type(self))
        return {key: held[key] for key in (*before, *further, *after) if key in held}

    def details(self) -> dict[str, Any]:
        """Return what the line says beside where and when: what the kind records, and how it was shown."""
        return {key: value for key, value in self.to_json().items() if key not in PLACED}

    def contradictions(self, session: SoFar, *, practised: bool) -> Iterator[str]:
        """Yield what in this record contradicts itself or the records before it.

        Where it is ``practised``, pages of feedback may follow the answer.
        """
        yield from ()

    def pressed_otherwise(self, session: SoFar, *, practised: bool) -> Iterator[str]:
        """Yield what in this record cannot come of its presses: a response time longer than all that was waited for."""
        total = sum([seconds for _, seconds in self.events])
        if self.response_time_s > total + ROUNDING_S * (1 + len(self.events)):
            yield f"the response time is {self.response_time_s:g} s, longer than its events took ({total:g} s)"

    def timed_by_press(self, *, last: bool) -> Iterator[str]:
        """Yield what is wrong if no press has the response time: the ``last`` one, or any."""
        times = [seconds for _, seconds in (self.events[-1:] if last else self.events)]
        if not is_near(self.response_time_s, times):
            yield f"the response time is {self.response_time_s:g} s, which is that of no press that could answer"

    def answer_key(self, *, last: bool) -> str | None:
        """Return the key that answered; None if that cannot be known."""
        if last:
            return self.events[-1][0] if self.events else None
        keys = {key for key, seconds in self.events if is_near(self.response_time_s, (seconds,))}
        return keys.pop() if len(keys) == 1 else None


class OutcomeRecord(Trial):
    """What came of a test of the observer: reports name those who failed, and can leave them out."""

    is_outcome = True

    test: Name

    @property
    def passed(self) -> bool:
        """Whether the test was passed."""
        raise NotImplementedError  # each kind says it; `SessionLog.of` takes no abstract class

    @property
    def reached(self) -> str:
        """What was reached, such as "passed 200 arcsec, pass mark 140 arcsec"."""
        raise NotImplementedError  # each kind says it; `SessionLog.of` takes no abstract class

    @property
    def words(self) -> str:
        """The test and what was reached in it, such as "stereo acuity: passed 200 arcsec, pass mark 140 arcsec"."""
        return f"{self.test.replace('_', ' ')}: {self.reached}"


@cache
def _order(kind: type[Trial]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the keys of a line of a kind, in order: those before and those after what this version does not know."""
    names = [field.alias or name for name, field in kind.model_fields.items()]
    common = [name for name in Trial.model_fields if name not in PLACED]
    own = [name for name in names if name not in Trial.model_fields]
    order = [*kind.written, *(name for name in own if name not in kind.written)]
    cut = order.index("...") if "..." in order else len(order)
    return (*PLACED, *order[:cut]), (*order[cut + 1 :], *common)


def is_near(value: float, others: Iterable[float]) -> bool:
    """Return whether a time equals one of ``others`` but for rounding."""
    return any(abs(value - other) <= ROUNDING_S for other in others)
