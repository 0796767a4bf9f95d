"""`kind: best_of_series`: leaf through a series, choose the closest, rate the choice."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, PositiveInt, Tag

from runner.blocks.best_of_series import DIFFICULTY, SIMILARITY, BestOfSeries, Series
from runner.presenter.scene import Offset
from runner.protocol.kinds.block_spec import BlockSpec, Fault, name_faults
from runner.protocol.kinds.scale_spec import ScaleSpec, scale_faults
from runner.protocol.parts import Line, Strict
from runner.protocol.setting import Setting, Stimuli

Factor = Annotated[str, Field(min_length=1, max_length=64)]
Names = Annotated[list[str], Field(min_length=2)]


class SeriesBySpec(Strict):
    """Series found by the stimuli's factors.

    Stimuli that agree in every factor of ``by`` make a series, sorted by the factor ``order``. Series that agree in the
    first factor of ``by`` are kept apart where that can be avoided.
    """

    by: Annotated[list[Factor], Field(min_length=1)]
    order: Factor


def _tag(value: Any) -> str:
    return (
        "by-factors" if isinstance(value, SeriesBySpec) or (isinstance(value, Mapping) and "by" in value) else "by-name"
    )


SomeSeries = Annotated[
    Annotated[SeriesBySpec, Tag("by-factors")] | Annotated[dict[Line, Names], Field(min_length=1), Tag("by-name")],
    Discriminator(_tag),
]


def _spec(scale: Any) -> ScaleSpec:
    return ScaleSpec.model_validate({key: getattr(scale, key) for key in ScaleSpec.model_fields})


class BestOfSeriesSpec(BlockSpec):
    """The observer leafs through each series, chooses a picture, and rates the choice.

    ``series`` names the pictures of each series in order, or says by which factors they are found. ``question`` stands
    above the picture in place of the experiment's. With ``see_all`` every picture must be seen before one can be
    chosen; with ``wrap`` the last is followed by the first. ``start`` is where in a series one begins.
    """

    kind: Literal["best_of_series"]
    series: SomeSeries
    question: Line | None = None
    ratings: Annotated[tuple[ScaleSpec, ...], Field(max_length=12)] = (_spec(SIMILARITY), _spec(DIFFICULTY))
    start: Literal["random", "first"] = "random"
    see_all: bool = True
    wrap: bool = False
    break_every: PositiveInt | None = None

    def make(self, setting: Setting) -> BestOfSeries:
        """Return the block in the observer's own order."""
        return BestOfSeries(
            self.found(setting.stimuli),
            self.question or setting.question,
            setting.single_layout(),
            setting.own_seed,
            scales=tuple(scale.make() for scale in self.ratings),
            start=self.start,
            see_all=self.see_all,
            wrap=self.wrap,
            break_every=self.break_every,
            style=setting.style,
            reference=setting.reference,
        )

    def found(self, stimuli: Stimuli) -> tuple[Series, ...]:
        """Return the series that the stimuli make."""
        if not isinstance(self.series, SeriesBySpec):
            return tuple(Series(name, tuple(names)) for name, names in self.series.items())
        by, order = self.series.by, self.series.order
        members: dict[tuple[str | float, ...], list[str]] = {}
        for name in stimuli.names:
            factors = stimuli.factors[name]
            if all(key in factors for key in (*by, order)):
                members.setdefault(tuple(factors[key] for key in by), []).append(name)
        return tuple(
            Series(
                "-".join(map(_word, values)),
                tuple(sorted(names, key=lambda name: _sortable(stimuli.factors[name][order]))),
                _word(values[0]),
            )
            for values, names in members.items()
        )

    def faults(self, stimuli: Stimuli) -> Iterator[Fault]:
        """Yield wrong stimuli or factors, series of one picture, and scales of one name."""
        yield from scale_faults(self.ratings, "ratings")
        if not isinstance(self.series, SeriesBySpec):
            for series, names in self.series.items():
                yield from name_faults(names, stimuli, "series", series, at_least=2)
            return
        known = sorted({key for name in stimuli.names for key in stimuli.factors[name]})
        places = [(("by", index), key) for index, key in enumerate(self.series.by)] + [(("order",), self.series.order)]
        for place, key in places:
            without = [name for name in stimuli.names if key not in stimuli.factors[name]]
            if without:
                remedy = f"the stimuli have: {', '.join(known)}" if known else "name the series' stimuli"
                yield Fault(f"the stimulus '{without[0]}' has no factor '{key}'", ("series", *place), remedy)
        if all(key in known for _, key in places):
            yield from self._alike(stimuli, self.series.order)

    def places_px(self, setting: Setting) -> tuple[Offset, ...]:
        """Return where the pictures stand."""
        return setting.single_layout().places_px

    def _alike(self, stimuli: Stimuli, order: str) -> Iterator[Fault]:
        """Yield series that are too short, or of which two pictures have the same place."""
        for series in self.found(stimuli):
            if len(series.stimuli) < 2:
                only = f"the series '{series.name}' has only the picture '{series.stimuli[0]}'"
                yield Fault(only, ("series", "by"), "name fewer factors")
            for one, other in zip(series.stimuli, series.stimuli[1:], strict=False):
                if stimuli.factors[one][order] == stimuli.factors[other][order]:
                    same = f"'{one}' and '{other}' of the series '{series.name}' have the same {order}"
                    yield Fault(same, ("series", "by"), "name the factor that tells them apart")


def _word(value: str | float) -> str:
    return value if isinstance(value, str) else f"{value:g}"


def _sortable(value: str | float) -> tuple[bool, float, str]:
    """Return a key by which numbers come before words."""
    return (True, 0.0, value) if isinstance(value, str) else (False, float(value), "")
