"""Simulated observers that answer by a Bradley-Terry law with known scores."""

from __future__ import annotations

import random
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, PositiveFloat

from documents import Finding, load_document
from runner.errors import SessionError
from runner.ports import Ask, KeyPress
from runner.tasks import Compare


class PublishedSpec(BaseModel):
    """A stimulus's published result: score and perceptual class."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    score: PositiveFloat
    perceptual_class: str = ""


class ObserverSpec(BaseModel):
    """A file of simulated observers."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    schema_version: Literal[1]
    kind: Literal["bradley_terry"]
    source: str = ""
    median_response_time_s: PositiveFloat = 2.0
    stimuli: Annotated[dict[str, PublishedSpec], Field(min_length=2)]


def read_observer(path: Path, stimuli: tuple[str, ...]) -> ObserverSpec:
    """Read the file of simulated observers at ``path``, which must score every one of ``stimuli``."""
    spec, source = load_document(path, ObserverSpec)
    place = source.place(("stimuli",))
    line, column = (place.line, place.column) if place else (None, None)
    missing = [name for name in stimuli if name not in spec.stimuli]
    if missing:
        raise SessionError(
            Finding(f"no score is given for {', '.join(missing)}", str(path), line, column, "add each with its score")
        )
    return spec


@dataclass(slots=True)
class BradleyTerryObserver:
    """Prefers picture i to j with probability s_i / (s_i + s_j) (Bradley & Terry 1952).

    Response times are lognormal about their median and only told, not waited for.
    """

    scores: Mapping[str, float]
    rng: random.Random
    median_response_time_s: float = 2.0

    def respond(self, ask: Ask, onset_s: float) -> KeyPress:
        """Choose between the two pictures shown, or go on where there is nothing to choose."""
        time_s = onset_s + self.median_response_time_s * self.rng.lognormvariate(0.0, 0.4)
        meanings = {meaning: key for key, meaning in ask.keys.items()}
        if isinstance(ask.task, Compare):
            first, second = ask.task.first, ask.task.second
            share = self.scores[first] / (self.scores[first] + self.scores[second])
            return KeyPress(meanings["first" if self.rng.random() < share else "second"], time_s)
        return KeyPress(next(iter(ask.keys)), time_s)
