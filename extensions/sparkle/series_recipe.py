"""`kind: sparkle_series`: plates × series × exposures, as in the thesis's first experiment (Section 4.5.1).

Every plate is photographed at every exposure, each photograph is brought to one mean luminance, and each series
changes all of them alike: brighter, or without colour.
"""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from itertools import groupby, product
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, ValidationError, model_validator
from pydantic.fields import FieldInfo

from documents.yaml import FileModel, Positive
from extensions.sparkle.painted_plate import BaseSpec, FlakesSpec, PaintedPlateSpec
from extensions.sparkle.plate_recipe import SparkleRecipe, too_large, without_spectra
from stimuli.errors import StimulusError
from stimuli.luminance import factor_to, mean_luminance_cd_m2
from stimuli.pictures import StereoImage
from stimuli.recipes import (
    MAX_STIMULI,
    BuildContext,
    Factors,
    MadePicture,
    Name,
    Progress,
    RecipeFault,
    Seconds,
    SeriesSpec,
    SeriesSpecs,
    View,
    stimulus_name,
    twin_names,
    twin_views,
)

if TYPE_CHECKING:
    from extensions.sparkle.studio import Studio


def _left_out(model: type[FlakesSpec]) -> None:
    """Let every key of ``model`` be left out, before it is built."""
    for name, key in model.__pydantic_fields__.items():
        kind: Any = Annotated[key.annotation, *key.metadata] if key.metadata else key.annotation
        model.__pydantic_fields__[name] = FieldInfo.from_annotated_attribute(kind | None, None)


class FlakesChangeSpec(FlakesSpec):
    """Where the flakes differ from the shared ones; the keys are those of the shared flakes."""

    @model_validator(mode="after")
    def _range_holds_the_median(self) -> FlakesChangeSpec:
        return self  # it is judged with the shared flakes


_left_out(FlakesChangeSpec)


class NamedPlateSpec(FileModel):
    """A plate by its name, and where it differs from the shared one."""

    name: Name
    """A name of your own, by which records and reports call it."""
    base: BaseSpec | None = None
    """The base between the flakes."""
    flakes: FlakesChangeSpec = FlakesChangeSpec.model_validate({})
    """The flakes."""
    coat_refractive_index: Annotated[float, Field(ge=1, le=4)] | None = None
    """The refractive index of the clear coat."""

    def flakes_over(self, shared: FlakesSpec) -> FlakesSpec:
        """Return ``shared`` with this plate's changes.

        Raises
        ------
        pydantic.ValidationError
            If the two together describe flakes that cannot be.
        """
        return FlakesSpec.model_validate({**shared.model_dump(), **self.flakes.model_dump(exclude_none=True)})

    def over(self, shared: PaintedPlateSpec) -> PaintedPlateSpec:
        """Return the plate ``shared`` with this plate's changes; raises as `flakes_over` does."""
        return PaintedPlateSpec(
            size_mm=shared.size_mm,
            coat_refractive_index=self.coat_refractive_index or shared.coat_refractive_index,
            coat_extinction_per_mm=shared.coat_extinction_per_mm,
            flakes=self.flakes_over(shared.flakes),
            base=self.base or shared.base,
        )


@dataclass(frozen=True, slots=True)
class SeriesPicture:
    """One stimulus of a `SparkleSeriesRecipe`."""

    name: str
    plate: NamedPlateSpec
    series: SeriesSpec
    exposure_s: float
    view: View

    @property
    def factors(self) -> Factors:
        """Its factors."""
        return {
            "paint": self.plate.name,
            "series": self.series.name,
            "exposure_s": self.exposure_s,
            "view": self.view,
        }


class SparkleSeriesRecipe(SparkleRecipe):
    """Series of exposures of several synthetic plates.

    ``plate`` is what the ``plates`` share. Without ``views`` all pictures are stereo, and no name ends in the view.
    """

    kind: Literal["sparkle_series"]
    target_mean_luminance_cd_m2: Positive
    """What the mean luminance of the pictures is brought to, in cd/m²."""
    plates: Annotated[tuple[NamedPlateSpec, ...], Field(min_length=1, max_length=MAX_STIMULI)]
    """The plates, and where each differs from the shared one."""
    exposures_s: Annotated[tuple[Seconds, ...], Field(min_length=1, max_length=32)]
    """The exposures, in seconds."""
    series: SeriesSpecs
    """Series that every plate is photographed in."""

    def pictures(self) -> tuple[SeriesPicture, ...]:
        """Return the stimuli: plate by plate, series by series, from exposure to exposure."""
        views: tuple[View | None, ...] = self.views or (None,)
        return tuple(
            SeriesPicture(
                stimulus_name(f"{plate.name}-{series.name}-{exposure_s:g}", view),
                plate,
                series,
                exposure_s,
                view or "stereo",
            )
            for plate, series, exposure_s, view in product(self.plates, self.series, self.exposures_s, views)
        )

    def factors(self) -> dict[str, Factors]:
        """Return each stimulus's paint, series, exposure and view."""
        return {picture.name: picture.factors for picture in self.pictures()}

    def faults(self) -> Iterator[RecipeFault]:
        """Yield names that stand twice or meet, too many pictures, and what of the plates cannot be rendered."""
        yield from twin_views(self.views)
        yield from twin_names((plate.name for plate in self.plates), "plates")
        yield from twin_names((series.name for series in self.series), "series")
        printed = [f"{exposure_s:g}" for exposure_s in self.exposures_s]
        for index, exposure in enumerate(printed):
            if exposure in printed[:index]:
                yield RecipeFault(("exposures_s", index), f"the exposure {exposure} s stands twice", "keep one")
        yield from self._twin_pictures()
        pictures = len(self.plates) * len(self.series) * len(self.exposures_s) * len(self.views or "1")
        if pictures > MAX_STIMULI:
            yield RecipeFault(("plates",), f"these are {pictures} pictures", f"a recipe makes {MAX_STIMULI} at most")
        faulty = False
        for index, plate in enumerate(self.plates):
            for fault in self._plate_faults(plate, index):
                faulty = True
                yield fault
        if not faulty:
            plates = (plate.over(self.plate) for plate in self.plates)
            yield from without_spectra(plates, self.lamp, self.further_lamps)

    def _plate_faults(self, plate: NamedPlateSpec, index: int) -> Iterator[RecipeFault]:
        try:
            whole = plate.over(self.plate)
        except ValidationError as error:
            message = str(error.errors()[0]["msg"]).removeprefix("Value error, ")
            yield RecipeFault(
                ("plates", index, "flakes"), f"'{plate.name}' and 'plate' do not fit: {message}", "change either"
            )
            return
        changed = plate.flakes.per_mm2 is not None
        for fault in too_large(whole, self.camera, ("plates", index, "flakes") if changed else ("plate", "flakes")):
            # What all plates share is reported once.
            if index == 0 or fault.location[0] == "plates":
                yield fault

    def _twin_pictures(self) -> Iterator[RecipeFault]:
        """Yield pictures whose names meet though their parts differ: a-b with c, and a with b-c."""
        pairs = {(plate.name.casefold(), series.name.casefold()) for plate in self.plates for series in self.series}
        called = Counter(f"{plate}-{series}" for plate, series in pairs)
        for name, count in sorted(called.items()):
            if count > 1:
                what = f"two series of pictures would be called '{name}'"
                yield RecipeFault(("series",), what, "give one another name")

    def tasks(self, context: BuildContext) -> Iterator[Mapping[str, str]]:
        """Yield each plate's pictures: its flakes are scattered once, and its photographs are kept until it is done."""
        shared = self.model_dump(
            mode="json", include={"kind", "lamp", "further_lamps", "camera", "target_mean_luminance_cd_m2"}
        )
        shared |= self.observer_key()
        for named, pictures in groupby(self.pictures(), key=lambda picture: picture.plate):
            plate, seed = named.over(self.plate).model_dump(mode="json"), plate_seed(self.seed, named.name)
            yield {
                planned.name: context.key(
                    self.sparkles,
                    shared=shared,
                    plate=plate,
                    seed=seed,
                    view=planned.view,
                    exposure_s=planned.exposure_s,
                    series=planned.series.key(),
                )
                for planned in pictures
            }

    def make(self, context: BuildContext, report: Progress, names: Collection[str]) -> Iterator[MadePicture]:
        """Yield the stimuli of ``names``; no more than one plate's photographs are in memory at a time.

        The sparkles of each plate and viewpoint are rendered once, and each exposure of them is developed once,
        whatever series show them.

        Raises
        ------
        StimulusError
            If a plate sends no light, so that nothing can bring it to the target luminance.
        """
        from extensions.sparkle.studio import Studio

        pictures = [planned for planned in self.pictures() if planned.name in names]
        done = 0
        for named, of_plate in groupby(pictures, key=lambda picture: picture.plate):
            seed = plate_seed(self.seed, named.name)
            plate = named.over(self.plate)
            scene = plate, self.lamp, self.camera, seed, context.pixel_pitch_mm, self.further_lamps
            studio = Studio(*scene, observer=str(self.observer))
            for picture in of_plate:
                report(f"rendering {picture.name}", done, len(pictures))
                yield _made(picture, studio, self.target_mean_luminance_cd_m2)
                done += 1
        report("done", done, done)


def plate_seed(seed: int, plate: str) -> int:
    """Return the seed of a plate by its name: other plates, or another order of them, leave its flakes alone."""
    return int.from_bytes(hashlib.sha256(f"{seed}/{plate}".encode()).digest()[:8]) >> 1


def _made(picture: SeriesPicture, studio: Studio, target_cd_m2: float) -> MadePicture:
    eyes = [photograph.xyz_cd_m2 for photograph in studio.photographs(picture.view, picture.exposure_s)]
    # One factor for both eyes: what one sees brighter than the other stays so.
    mean_cd_m2 = mean_luminance_cd_m2(StereoImage(eyes[0], eyes[-1]))
    if mean_cd_m2 <= 0:
        remedy = "give it a base or flakes that reflect, and a lamp that shines"
        raise StimulusError.of(f"the plate '{picture.plate.name}' sends no light", remedy)
    adapted = factor_to(mean_cd_m2, target_cd_m2)
    series = picture.series
    shown = [series.apply(eye, adapted * series.luminance_scale) for eye in eyes]
    steps = (
        *studio.steps(picture.view, picture.exposure_s),
        {"step": "adapt", "target_mean_luminance_cd_m2": target_cd_m2, "luminance_scale": adapted},
        *series.steps(),
    )
    return MadePicture(picture.name, StereoImage(shown[0], shown[-1]), picture.factors, steps)
