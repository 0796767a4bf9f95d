"""What the session engine needs of the world, and no more: a presenter, an observer, the answers of others.

What an Ask is about, in words that do not need eyes: for simulated observers, and for whoever reads a session.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, Protocol, TypeAlias

from analysis.records import PooledBatch
from runner.scene import Offset, Scene

if TYPE_CHECKING:
    from numpy import float64
    from numpy.typing import NDArray

# A second press of what answered, or the second click of a double click, was never meant for what came after the first.
DOUBLE_S = 0.25
MOST_IGNORED = 20  # of a trial are recorded one by one
Why: TypeAlias = Literal["before", "early", "double", "held", "no_meaning"]


@dataclass(frozen=True, slots=True)
class GoOn:
    """Nothing is asked: any meaning will do."""


@dataclass(frozen=True, slots=True)
class Compare:
    """Which of two is closer to ``reference`` (a stimulus; None for a physical one, or where there is none)?

    Meanings: ``first``, ``second``; where ties are allowed, ``no_difference`` and ``not_sure`` are meanings too.
    """

    first: str
    second: str
    reference: str | None = None


@dataclass(frozen=True, slots=True)
class Browse:
    """Which of a ``series`` is the closest? ``index`` is shown now, ``seen`` were shown before or are now.

    Meanings: ``previous``, ``next`` and ``choose``; ``choose`` may be missing while there are some left to see.
    """

    series: tuple[str, ...]
    index: int
    seen: frozenset[int]
    reference: str | None = None


@dataclass(frozen=True, slots=True)
class Rate:
    """What number on the scale ``name`` does ``stimulus`` deserve, from ``lowest`` to ``highest``?

    ``current`` is where the marker stands, None if nowhere yet. Meanings: the numbers as text, and ``lower``,
    ``higher``, ``accept``.
    """

    name: str
    lowest: int
    highest: int
    stimulus: str | None = None
    reference: str | None = None
    current: int | None = None


@dataclass(frozen=True, slots=True)
class Choose:
    """Which of the ``options`` (meanings)? ``correct`` is the right one where there is one.

    ``strength`` says how plain it is, in a unit that belongs to ``name``, such as arcseconds of disparity. Who sees
    nothing guesses, where the choice is ``forced``; otherwise the options are "yes" and "no", and they say no. There
    "no" is correct where there is nothing to see, and ``strength`` is None.
    """

    name: str
    options: tuple[str, ...]
    correct: str | None = None
    strength: float | None = None
    forced: bool = True


@dataclass(frozen=True, slots=True)
class Write:
    """Words or a number are typed; meanings: ``text`` of a typed character, ``erase``, ``accept``.

    ``accept`` may be missing while nothing acceptable is ``typed``; ``example`` would be acceptable.
    """

    name: str
    typed: str = ""
    number: bool = False
    example: str = "1"


NOTHING = GoOn()

Task: TypeAlias = GoOn | Compare | Browse | Rate | Choose | Write


@dataclass(frozen=True, slots=True)
class Ignored:
    """A press that was no answer: its ``key``, its seconds ``from_onset_s`` of the scene, and ``why``.

    ``why`` is ``before`` the scene was shown, too ``early`` after that or after another press, ``double`` of the press
    that answered the scene before, or ``held`` down since then; ``no_meaning`` is a key that answers nothing there.
    """

    key: str
    from_onset_s: float
    why: Why


@dataclass(frozen=True, slots=True)
class KeyPress:
    """Something an observer did at ``time_s`` on the presenter's monotonic clock.

    ``key`` is a key going down (``up``, ``space``, ``a``), a step of the wheel (``wheel_up``, ``wheel_down``), a button
    of a gamepad (``pad_a``, ``pad_left``), a click (``click MEANING`` of the target that was hit) or a typed character
    (``text X``). ``ignored`` are presses that were made for the same scene and did not answer it, ``ignored_more`` is
    how many others there were. ``by_place`` is the digit or Latin letter that an American keyboard has at the key's
    place, where the key prints something else: the key counts as that where what it prints means nothing.
    """

    key: str
    time_s: float
    ignored: tuple[Ignored, ...] = field(default=(), compare=False)
    ignored_more: int = field(default=0, compare=False)
    by_place: str = field(default="", compare=False)


@dataclass(frozen=True, slots=True)
class Holding:
    """A scene held for ``frames`` frames of ``period_s`` from ``onset_s`` on; the next onset shows how long it was."""

    onset_s: float
    frames: int
    period_s: float

    def missed(self, next_onset_s: float) -> int:
        """Return how many frames longer than asked the scene stood, to the nearest frame; 0 if it was not longer."""
        return max(0, round((next_onset_s - self.onset_s) / self.period_s) - self.frames)


class WindowClosed(Exception):
    """The window was closed while an answer was awaited."""


class ObserverLeft(Exception):
    """The observer asked to leave."""


@dataclass(frozen=True, slots=True)
class Button:
    """A rectangle that can be clicked: its middle and size (width, height) in pixels, as places in a scene are."""

    offset_px: Offset
    size_px: tuple[int, int]

    def holds(self, place_px: Offset) -> bool:
        """Return whether ``place_px`` lies in it."""
        return all(
            2 * abs(place - middle) <= size
            for place, middle, size in zip(place_px, self.offset_px, self.size_px, strict=True)
        )


@dataclass(frozen=True, slots=True)
class Ask:
    """A scene, what each key would mean to the block that shows it, and the scene to expect after it.

    ``targets`` maps further meanings to where they can be clicked; with ``typing``, any character can be typed too.
    ``task`` says what is asked to those who answer without looking. An answer that comes less than ``least_s`` after
    the scene's onset is none.
    """

    scene: Scene
    keys: Mapping[str, str] = field(default_factory=dict)
    upcoming: Scene | None = None
    task: Task = NOTHING
    targets: Mapping[str, Button] = field(default_factory=dict)
    typing: bool = False
    least_s: float = 0.0

    def meaning(self, key: str) -> str | None:
        """Return what ``key`` means here, None if nothing."""
        if key in self.keys:
            return self.keys[key]
        kind, _, rest = key.partition(" ")
        if kind == "click" and rest in self.targets:
            return rest
        return key if kind == "text" and rest and self.typing else None


@dataclass(frozen=True, slots=True, eq=False)
class PooledAnswers:
    """What other sessions answered: how many times stimulus i won over j, shape (n, n), and each one's answers."""

    wins: NDArray[float64]
    sessions: Mapping[str, int] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, eq=False)
class ChooseBatch:
    """A block is to choose its next pairs of ``stimuli`` by the answers of all observers: ``choose`` returns them.

    The block is sent the batch, which may be one that ``choose`` returned before and a log has kept.
    """

    stimuli: tuple[str, ...]
    choose: Callable[[PooledAnswers], PooledBatch]


class Pool(Protocol):
    """Where the answers of all observers are known."""

    def batch(self, block: int, trial: int, step: ChooseBatch) -> PooledBatch:
        """Return the batch whose first trial is ``trial`` of ``block``; raise WindowClosed if there is none."""


class NoOthers:
    """A pool in which there is no other session."""

    def batch(self, block: int, trial: int, step: ChooseBatch) -> PooledBatch:
        """Let the block choose by its own answers."""
        from numpy import zeros

        return step.choose(PooledAnswers(zeros((len(step.stimuli), len(step.stimuli)))))


class AnyPresenter(Protocol):
    """Shows scenes."""

    def show(self, scene: Scene) -> float:
        """Show ``scene`` and return its onset in seconds on the monotonic clock; an equal scene is not redrawn."""

    def prefetch(self, scene: Scene) -> None:
        """Make ready what ``scene`` will need, while there is time."""

    def hold(self, scene: Scene, seconds: float) -> Holding:
        """Show ``scene`` and return in time for the next scene to follow after the nearest whole number of frames.

        Keys pressed meanwhile mean nothing.
        """


class Observer(Protocol):
    """Answers what is shown: a person, a simulation or a replay; the engine does not know which."""

    def respond(self, ask: Ask, onset_s: float) -> KeyPress:
        """Return the first press that means something to ``ask``, or of ``escape``, after ``onset_s``.

        Raises WindowClosed if there is nothing left to answer to.
        """


@dataclass(frozen=True, slots=True)
class Response:
    """What came back for an Ask: the key, what it means to the block, and the time since the scene's onset."""

    key: str
    meaning: str
    time_s: float


@dataclass(frozen=True, slots=True)
class Hold:
    """A scene to be shown for ``seconds``, to the nearest whole frame; ``what`` names it in the record."""

    what: str
    scene: Scene
    seconds: float


def answer(response: Response | PooledBatch | None) -> Response:
    """Return ``response``, which the engine never leaves out after an Ask."""
    if not isinstance(response, Response):
        raise RuntimeError("the engine sent no response to an Ask")
    return response
