"""What every kind of block is: its entry in an experiment file, and the coroutine that the engine runs."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Container, Generator, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar, Literal, TypeAlias

from pydantic import Field

from analysis.records import PooledBatch
from documents.text import counted, did_you_mean
from documents.yaml import FileModel
from runner.blocks.context import BlockContext, Stimuli
from runner.blocks.orders import Pair
from runner.ports import Ask, ChooseBatch, Hold, Response
from runner.scene import Offset
from stimuli.pictures import StereoImage

SECONDS_PER_TRIAL = 5.0
LEAST_MS = 100.0  # no one reacts to a picture sooner


class SessionEnd(Exception):
    """Raised by a block after its last record to end the session there, complete; ``facts`` stand in its end record."""

    def __init__(self, facts: Mapping[str, Any]) -> None:
        super().__init__()
        self.facts = dict(facts)


@dataclass(frozen=True, slots=True)
class Draft:
    """What is to be recorded of one trial; the engine adds where and when.

    ``stimuli`` are the names shown, for the record of what the gamut clip cost. ``repeatable`` says whether it makes
    sense to ask it once more, as it does not of a page of words.
    """

    kind: str
    data: Mapping[str, Any] = field(default_factory=dict)
    stimuli: tuple[str, ...] = ()
    response_time_s: float = 0.0
    repeatable: bool = True


# A block yields an Ask and is sent its Response, yields a Hold and is sent None when it is time for the next scene,
# yields a Draft and is sent None once that is on disk, or yields a ChooseBatch and is sent the batch once that is.
Step: TypeAlias = Ask | Hold | Draft | ChooseBatch
Steps: TypeAlias = Generator[Step, Response | PooledBatch | None, None]
# Names of stimuli, and the pairs of their numbers i < j that are compared; all of them if None.
Pooled: TypeAlias = tuple[tuple[str, ...], Container[Pair] | None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """One part of a session: an ``entry`` of ``blocks:`` as one observer meets it.

    Attributes
    ----------
    entry
        What people wrote of it, which is of some kind.
    steps
        Starts the coroutine; called again after an interruption it must yield the same steps.
    trials
        How many scored trials it will record.
    expected_s
        About how long it will take.
    keys
        What the keys mean in it, beside the space bar that continues.
    places_px
        Where it shows stimuli, as offsets from the middle of each eye's view.
    pictures
        Pictures of its own making, by the names that its scenes show them by.
    scale_ends
        The lowest and the highest number of each scale that it asks, by the name of its ratings.
    facts
        What a check says of it beside that, such as how many pairs each group has.
    """

    entry: BlockKind
    steps: Callable[[], Steps]
    trials: int = 0
    expected_s: float = 0.0
    keys: Mapping[str, str] = field(default_factory=dict)
    places_px: tuple[Offset, ...] = ()
    pictures: Mapping[str, Callable[[], StereoImage]] = field(default_factory=dict)
    scale_ends: Mapping[str, tuple[int, int]] = field(default_factory=dict)
    facts: Mapping[str, Any] = field(default_factory=dict)


# Names of stimuli as a file lists them; "all" means all but the reference.
StimulusNames: TypeAlias = Literal["all"] | Annotated[list[str], Field(min_length=1)]


@dataclass(frozen=True, slots=True)
class Fault:
    """Something wrong with a block, at ``path`` below its entry in the file."""

    message: str
    path: tuple[str | int, ...] = ()
    remedy: str = ""


@dataclass(frozen=True, slots=True)
class Named:
    """A ``name`` by which results put answers together, at ``path`` below the block's entry in the file.

    ``what`` is named; ``meaning`` must be the same wherever blocks of a kind use the name, ``words`` say what it is.
    """

    what: str
    name: str
    meaning: Hashable
    words: str
    path: tuple[str | int, ...]


class BlockKind(FileModel):
    """One entry of ``blocks:``. A subclass holds its keys, names its ``kind``, and says how an observer meets it."""

    is_page: ClassVar[bool] = False
    """Whether it is a page of words, which asks nothing."""
    begins_with_words: ClassVar[bool] = False
    """Whether what comes first of it is a page."""
    has_trials: ClassVar[bool] = True
    """Whether it has trials of its own, which can be practised."""
    by_scores: ClassVar[bool] = True
    """Whether simulated observers answer by scores of the stimuli: not where every question has a right answer."""
    pairs_by_answers: ClassVar[bool] = False
    """Whether the answers decide which pairs are asked: how often each is, is not known beforehand."""
    tests_observers: ClassVar[bool] = False
    """Whether it tests the observer, who is told after the session what came of it."""

    kind: str
    """Which kind of entry this is; it decides which other keys there are."""
    # The standard value is left out of what a digest is made of: experiments from before the key keep theirs.
    least_response_time_ms: Annotated[float, Field(ge=0, le=5000, exclude_if=lambda ms: ms == LEAST_MS)] = LEAST_MS
    """Milliseconds after a scene's onset before which a press does not answer it."""

    @property
    def least_s(self) -> float:
        """The least response time in seconds."""
        return self.least_response_time_ms / 1000.0

    @abstractmethod
    def meet(self, setting: BlockContext) -> Block:
        """Return the block as the observer of ``setting`` meets it, also where `faults` finds some.

        Raises
        ------
        LayoutError
            If something does not fit an eye's view.
        SessionError
            If the rig cannot show it.
        """

    def faults(self, stimuli: Stimuli) -> Iterator[Fault]:
        """Yield what is wrong with it beyond its own keys: stimuli that there are not, or that do not suit it."""
        yield from ()

    def doubts(self, setting: BlockContext) -> Iterator[Fault]:
        """Yield what a check warns of: it runs, but is perhaps not what was meant."""
        yield from ()

    def unpractised(self) -> Iterator[Fault]:
        """Yield why it cannot be practised."""
        if not self.has_trials:
            yield Fault(f"'{self.kind}' has no trials to practise", ("kind",), "name a scored kind")

    @classmethod
    def in_words(cls, facts: Mapping[str, Any]) -> Sequence[str]:
        """Return what a check says of its `Block.facts`; without words of its own, they are listed."""
        return ()

    def pooled(self, stimuli: Stimuli) -> Pooled | None:
        """Return what it compares if the answers of all observers choose its pairs."""
        return None

    def named(self, stimuli: Stimuli) -> Iterator[Named]:
        """Yield the names by which results put its answers together with those of other blocks of its kind."""
        yield from ()


def chosen(names: StimulusNames, stimuli: Stimuli) -> tuple[str, ...]:
    """Return the stimuli that a list of names, or ``all``, means."""
    return stimuli.names if names == "all" else tuple(names)


def name_faults(names: StimulusNames, stimuli: Stimuli, *path: str | int, at_least: int = 1) -> Iterator[Fault]:
    """Yield the faults of a list of stimuli: unknown names, names that stand twice, too few."""
    if names != "all":
        for index, name in enumerate(names):
            if name not in stimuli.factors:
                yield Fault(
                    f"the recipe makes no stimulus '{name}'", (*path, index), _nearest(name, tuple(stimuli.factors))
                )
            elif name in names[:index]:
                yield Fault(f"the stimulus '{name}' stands twice", (*path, index), "remove one")
    count = len(chosen(names, stimuli))
    if count < at_least:
        yield Fault(f"{counted(count, 'stimulus is', 'stimuli are')} too few", path, f"name {at_least} or more")


def _nearest(name: str, known: Sequence[str]) -> str:
    return did_you_mean(name, known, "the recipe makes: " + ", ".join(known[:20]))
