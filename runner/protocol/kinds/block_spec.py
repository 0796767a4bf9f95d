"""What every kind of block in an experiment file can do."""

from __future__ import annotations

import difflib
from abc import abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field

from runner.blocks.steps import Block
from runner.presenter.scene import Offset
from runner.protocol.parts import Strict
from runner.protocol.setting import Setting, Stimuli

Some = Literal["all"] | Annotated[list[str], Field(min_length=1)]


@dataclass(frozen=True, slots=True)
class Fault:
    """Something wrong with a block, at ``path`` below its entry in the file."""

    message: str
    path: tuple[str | int, ...] = ()
    remedy: str = ""


class BlockSpec(Strict):
    """One entry of ``blocks:``. A subclass holds its keys, ``kind`` among them."""

    @abstractmethod
    def make(self, setting: Setting) -> Block:
        """Return the block as the observer of ``setting`` meets it; `faults` has found none."""

    def faults(self, stimuli: Stimuli) -> Iterator[Fault]:
        """Yield what is wrong with it beyond its own keys: stimuli that there are not, or that do not suit it."""
        yield from ()

    def rig_faults(self, setting: Setting) -> Iterator[Fault]:
        """Yield what the rig of ``setting`` cannot show of it, beside its layout."""
        yield from ()

    def places_px(self, setting: Setting) -> tuple[Offset, ...]:
        """Return where it shows stimuli, as offsets from the middle of each eye's view.

        Raises
        ------
        InputError
            If something does not fit, about the experiment's ``layout``.
        """
        return ()


def chosen(some: Some, stimuli: Stimuli) -> tuple[str, ...]:
    """Return the stimuli that a list of names, or ``all``, means."""
    return stimuli.names if some == "all" else tuple(some)


def name_faults(some: Some, stimuli: Stimuli, *path: str | int, at_least: int = 1) -> Iterator[Fault]:
    """Yield the faults of a list of stimuli: unknown names, names that stand twice, too few."""
    if some != "all":
        for index, name in enumerate(some):
            if name not in stimuli.factors:
                yield Fault(
                    f"the recipe makes no stimulus '{name}'", (*path, index), _nearest(name, tuple(stimuli.factors))
                )
            elif name in some[:index]:
                yield Fault(f"the stimulus '{name}' stands twice", (*path, index), "remove one")
    count = len(chosen(some, stimuli))
    if count < at_least:
        yield Fault(f"{count} stimuli are too few", path, f"name {at_least} or more")


def _nearest(name: str, known: Sequence[str]) -> str:
    near = difflib.get_close_matches(name, known, n=1)
    return f"did you mean '{near[0]}'?" if near else "the recipe makes: " + ", ".join(known[:20])
