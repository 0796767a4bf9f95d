"""`kind: preference`: stereo against flat versions of the same pictures."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field, PositiveInt, model_validator

from runner.blocks.layouts import PairLayout, SingleLayout
from runner.blocks.preference import Preference, Versions
from runner.presenter.scene import Offset
from runner.protocol.kinds.all_pairs import BLANK_BETWEEN_S
from runner.protocol.kinds.block_spec import BlockSpec, Fault, name_faults
from runner.protocol.parts import Line, Seconds, ShortSeconds
from runner.protocol.setting import Setting, Stimuli

Pair = Annotated[list[str], Field(min_length=2, max_length=2)]
SomePairs = Literal["all"] | Annotated[list[Pair], Field(min_length=1)]


class PreferenceSpec(BlockSpec):
    """Both versions of each picture, and which was closer.

    ``pairs`` are [stereo, flat], or ``all`` that the recipe makes: stimuli that differ in the factor ``view`` alone.
    In a ``sequence`` each stays for ``exposure_s``, or until the observer goes on if that is left out, with
    ``blank_between_s`` between the two; shown at once they stay until answered, or for ``exposure_s``. ``question``
    takes the place of the experiment's.
    """

    kind: Literal["preference"]
    pairs: SomePairs = "all"
    presentation: Literal["sequence", "simultaneous"] = "sequence"
    question: Line | None = None
    repeats: PositiveInt = 1
    break_every: PositiveInt | None = None
    exposure_s: Seconds | None = None
    blank_between_s: ShortSeconds | None = None
    blank_s: ShortSeconds = 0.0

    @model_validator(mode="after")
    def _intervals(self) -> PreferenceSpec:
        if self.presentation == "simultaneous" and self.blank_between_s is not None:
            raise ValueError("'blank_between_s' belongs to 'presentation: sequence'; 'blank_s' lies between trials")
        return self

    def make(self, setting: Setting) -> Preference:
        """Return the block in the observer's own order."""
        between_s = BLANK_BETWEEN_S if self.blank_between_s is None else self.blank_between_s
        return Preference(
            self.versions(setting.stimuli),
            self.question or setting.question,
            self._layout(setting),
            setting.pair_seed,
            setting.own_seed,
            flip_sides=setting.is_second_of_pair,
            repeats=self.repeats,
            exposure_s=self.exposure_s,
            blank_between_s=between_s if self.presentation == "sequence" else 0.0,
            blank_s=self.blank_s,
            break_every=self.break_every,
            style=setting.style,
            reference=setting.reference,
        )

    def versions(self, stimuli: Stimuli) -> tuple[Versions, ...]:
        """Return the pairs that are named, or those that the stimuli's factors make."""
        if self.pairs != "all":
            return tuple(Versions(stereo, flat) for stereo, flat in self.pairs)
        found = (views for views in _by_picture(stimuli).values() if {"stereo", "flat"} <= set(views))
        return tuple(Versions(views["stereo"][0], views["flat"][0]) for views in found)

    def faults(self, stimuli: Stimuli) -> Iterator[Fault]:
        """Yield wrong names, versions the wrong way round, pairs that stand twice, and pairs that are not clear."""
        remedy = "name the pairs [stereo, flat]"
        if self.pairs == "all":
            if not self.versions(stimuli):
                yield Fault("no picture of the recipe is there in stereo and flat", ("pairs",), remedy)
            for views in _by_picture(stimuli).values():
                for view, names in views.items():
                    if len(names) > 1 and len(views) > 1:
                        yield Fault(
                            f"nothing but their names tells {names[0]} and {names[1]} apart, both {view}",
                            ("pairs",),
                            remedy,
                        )
            return
        for index, pair in enumerate(self.pairs):
            yield from name_faults(pair, stimuli, "pairs", index)
            if pair in self.pairs[:index]:
                yield Fault(f"the pair {pair[0]}, {pair[1]} stands twice", ("pairs", index), "remove one")
            for place, (name, view) in enumerate(zip(pair, ("stereo", "flat"), strict=True)):
                known = stimuli.factors.get(name, {}).get("view")
                if known is not None and known != view:
                    yield Fault(f"'{name}' is {known}, not {view}", ("pairs", index, place), remedy)

    def places_px(self, setting: Setting) -> tuple[Offset, ...]:
        """Return where the pictures stand."""
        return self._layout(setting).places_px

    def _layout(self, setting: Setting) -> PairLayout | SingleLayout:
        return setting.single_layout() if self.presentation == "sequence" else setting.pair_layout()


def _by_picture(stimuli: Stimuli) -> dict[frozenset[tuple[str, str | float]], dict[str, list[str]]]:
    """Return the names of stimuli that are stereo or flat, by all their other factors and by view."""
    pictures: dict[frozenset[tuple[str, str | float]], dict[str, list[str]]] = {}
    for name in stimuli.names:
        factors = stimuli.factors[name]
        view = factors.get("view")
        if view in ("stereo", "flat"):
            picture = frozenset((key, value) for key, value in factors.items() if key != "view")
            pictures.setdefault(picture, {}).setdefault(str(view), []).append(name)
    return pictures
