"""Simulated observers by file: what they judge by, and how they depart from it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, TypeAlias

from pydantic import Field

from documents import Finding, load_document
from documents.yaml import FileModel, OneOf, Positive, YamlSource
from runner.errors import SessionError
from runner.observers.behaviour import BehaviourSpec
from runner.views.field_types import Line


class PublishedSpec(FileModel):
    """A stimulus's published result: score and perceptual class."""

    score: Positive
    """The score, on any scale of ratios."""
    perceptual_class: str = ""
    """The perceptual class that was published."""


class ScoredObserverSpec(BehaviourSpec):
    """Observers who judge by given scores."""

    schema_version: Literal[1]
    """The version of the file format: 1."""
    kind: Literal["bradley_terry"]
    """Which kind of entry this is; it decides which other keys there are."""
    source: str = ""
    """Where the numbers come from, in words."""
    stimuli: Annotated[dict[str, PublishedSpec], Field(default_factory=dict, min_length=2)]
    """The score of every stimulus, by name; left out, the observers answer only questions with a right answer."""

    @property
    def scores(self) -> dict[str, float]:
        """The scores by stimulus."""
        return {name: stimulus.score for name, stimulus in self.stimuli.items()}


class ImageBasedObserverSpec(BehaviourSpec):
    """Observers who judge by how far a picture's pixels are from those of the ``reference`` picture.

    The log odds of one picture against another are the difference of their mean ΔE00, times ``slope_per_delta_e_00``.
    The ``reference`` is a stimulus; left out, it is the experiment's reference picture.
    """

    schema_version: Literal[1]
    """The version of the file format: 1."""
    kind: Literal["image_based"]
    """Which kind of entry this is; it decides which other keys there are."""
    source: str = ""
    """Where the numbers come from, in words."""
    slope_per_delta_e_00: Positive = 1.0
    """The log odds for each ΔE00 by which two pictures differ from the reference."""
    reference: Line | None = None
    """The stimulus that pictures are judged against; left out, the experiment's."""


ObserverSpec: TypeAlias = ScoredObserverSpec | ImageBasedObserverSpec


class ObserverFile(OneOf[Annotated[ObserverSpec, Field(discriminator="kind")]]):
    """A file of simulated observers."""


KINDS = ("bradley_terry", "image_based")


def read_observer(path: Path, stimuli: tuple[str, ...] = (), experiment_reference: str | None = None) -> ObserverSpec:
    """Read the file of simulated observers at ``path``, which must be able to judge every one of ``stimuli``.

    Without ``stimuli``, only the file itself is checked. ``experiment_reference`` is the experiment's reference
    picture, None if it has no picture of one.

    Raises
    ------
    InputError
        With every fault of the file; if stimuli have no score, or observers judge by a picture that there is not.
    """
    document, source = load_document(path, ObserverFile)
    spec = document.root
    if isinstance(spec, ScoredObserverSpec):
        missing = [name for name in stimuli if name not in spec.stimuli]
        if missing:
            what = f"no score is given for {', '.join(missing)}"
            raise _fault(what, source, "stimuli", "add each with its score")
    elif stimuli:
        reference = spec.reference or experiment_reference
        if reference is None:
            what = "the experiment has no reference picture, and none is named here"
            raise _fault(
                what, source, "reference", "write reference: and the stimulus that the others are compared with"
            )
        if reference not in stimuli:
            what = f"the recipe makes no stimulus '{reference}'"
            raise _fault(what, source, "reference", "the recipe makes: " + ", ".join(stimuli[:20]))
    return spec


def read_scored_observer(path: Path, stimuli: tuple[str, ...] = ()) -> ScoredObserverSpec:
    """Read a file of observers who judge by given scores, as `read_observer` does."""
    spec = read_observer(path, stimuli)
    if not isinstance(spec, ScoredObserverSpec):
        raise SessionError(Finding(f"'kind' is '{spec.kind}'", str(path), remedy="observers with given scores"))
    return spec


def _fault(message: str, source: YamlSource, key: str, remedy: str) -> SessionError:
    return SessionError(source.finding((key,), message, remedy))
