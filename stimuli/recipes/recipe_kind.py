"""The interface of every kind of recipe: its pictures, and how they are made.

A kind is a class in a file of its own; `stimuli.recipes.recipe` lists the kinds. What makes pictures is imported only
when pictures are made, so that a set that is in the cache loads none of it.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from devices.colour_matching import DEFAULT_OBSERVER, ObserverSpec
from documents import Finding
from documents.yaml import FileModel, Path_
from stimuli.recipes.build_context import BuildContext, DisplaySetup, Factors, MadePicture, Progress
from stimuli.recipes.values import SparklesSpec, Views


@dataclass(frozen=True, slots=True)
class RecipeFault:
    """A fault, the place of the value at fault in the recipe, and what would be right."""

    location: Path_
    message: str
    remedy: str


class RecipeKind(FileModel):
    """A recipe. A subclass holds its keys, ``kind`` among them; ``observer`` is that of its pictures' XYZ."""

    schema_version: Literal[1]
    """The version of the file format: 1."""
    kind: str
    """Which kind of entry this is; it decides which other keys there are."""
    views: Views | None = None
    """The views that every stimulus is made in: stereo, flat or both."""
    sparkles: SparklesSpec | None = None
    """What counts as a sparkle in the manifest's statistics."""
    observer: ObserverSpec = DEFAULT_OBSERVER
    """The colorimetric observer of the XYZ, such as CIE 1931 2 or CIE 1964 10."""

    @abstractmethod
    def factors(self) -> dict[str, Factors]:
        """Return the factors of each stimulus, by name, in the recipe's order.

        A picture from a file that is shown as it is stored has no ``view`` before it is read; a built set knows it.
        """

    def names(self) -> tuple[str, ...]:
        """Return the names of all stimuli, in the recipe's order."""
        return tuple(self.factors())

    def observer_key(self) -> dict[str, str]:
        """Return the observer for a picture's key, nothing for CIE 1931 2°."""
        return {} if self.observer == DEFAULT_OBSERVER else {"observer": str(self.observer)}

    @abstractmethod
    def faults(self) -> Iterator[RecipeFault]:
        """Yield the faults that the schema does not check."""

    def inputs(self) -> dict[str, Path_]:
        """Return each file that the recipe names, with the place in it that names it first."""
        return {}

    def may_lie_outside(self) -> frozenset[str]:
        """Return those of `inputs` that need not lie in the recipe's folder."""
        return frozenset()

    def file_findings(self, folder: Path) -> list[Finding]:
        """Return what is found wrong with the files that it names, in ``folder``, before any picture is made."""
        return []

    def display_facts(self, setup: DisplaySetup | None) -> dict[str, Any]:
        """Return the facts of ``setup`` that the pictures depend on, for the cache's key."""
        return {}

    def decoder_facts(self) -> dict[str, Any]:
        """Return the versions of libraries that the pictures depend on, for the cache's key."""
        return {}

    @abstractmethod
    def tasks(self, context: BuildContext) -> Iterator[Mapping[str, str]]:
        """Yield pictures that are best made together: their keys by name, in the recipe's order.

        A picture's key is the hash of everything that its pixels and its steps depend on, and of nothing else, so that
        changing one stimulus leaves the others' keys as they were. Its name and its factors are no part of it.
        """

    @abstractmethod
    def make(self, context: BuildContext, report: Progress, names: Collection[str]) -> Iterator[MadePicture]:
        """Yield the stimuli of ``names``, in the recipe's order, each sampled for the display of ``context``.

        Raises
        ------
        InputError
            If a file cannot be read, or a picture cannot be made: the finding names the file, or the stimulus.
        """


def stimulus_name(name: str, view: str | None) -> str:
    """Return the name of the stimulus that shows ``name`` in ``view``, or as it is stored."""
    return f"{name}-{view}" if view else name


def twin_names(names: Iterable[str], *location: str) -> Iterator[RecipeFault]:
    """Yield each name in the list at ``location`` that stands there before.

    Names become file names, and some file systems do not distinguish A from a.
    """
    seen: set[str] = set()
    for index, name in enumerate(names):
        if name.casefold() in seen:
            yield RecipeFault((*location, index, "name"), f"the name '{name}' stands twice", "give it another")
        seen.add(name.casefold())


def twin_views(views: Sequence[str] | None) -> Iterator[RecipeFault]:
    """Yield a fault if a view stands twice."""
    if views and len(set(views)) != len(views):
        yield RecipeFault(("views",), "a view stands twice", "keep one")
