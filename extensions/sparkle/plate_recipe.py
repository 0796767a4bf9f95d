"""`kind: sparkle_plate`: photographs of one synthetic plate at several exposures."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from itertools import product
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from documents.yaml import FileModel, Path_, Positive
from extensions.sparkle.painted_plate import FurtherLamps, PaintedPlateSpec
from extensions.sparkle.scene import Camera, Lamp
from stimuli.pictures import StereoImage, XYZImage
from stimuli.recipes import (
    MAX_STIMULI,
    BuildContext,
    Factors,
    MadePicture,
    Name,
    Progress,
    RecipeFault,
    RecipeKind,
    Seconds,
    Views,
    stimulus_name,
    twin_names,
    twin_views,
)

# What a plate may ask for: either takes a few GB of memory.
MAX_FLAKES = 50_000_000
MAX_CAMERA_PIXELS = 100_000_000


class ShotSpec(FileModel):
    """One photograph: exposed for so long, then all its XYZ multiplied."""

    name: Name
    """A name of your own, by which records and reports call it."""
    exposure_s: Seconds
    """Seconds of exposure, such as 0.5 or 1/15."""
    luminance_scale: Positive = 1.0
    """A factor for all XYZ."""


class SparkleRecipe(RecipeKind):
    """Photographs of synthetic plates."""

    seed: Annotated[int, Field(ge=0, lt=2**63)]
    """The seed of all random orders."""
    plate: PaintedPlateSpec
    """The plate; in a series, what all plates share."""
    lamp: Lamp
    """The lamp."""
    further_lamps: FurtherLamps = ()
    """More lamps."""
    camera: Camera
    """The camera that photographs the plate."""


class SparklePlateRecipe(SparkleRecipe):
    """Photographs of one synthetic plate at several exposures; equal seeds make equal plates."""

    kind: Literal["sparkle_plate"]
    views: Views = ("stereo", "flat")
    """The views that every stimulus is made in: stereo, flat or both."""
    stimuli: Annotated[tuple[ShotSpec, ...], Field(min_length=1, max_length=MAX_STIMULI)]
    """The photographs of the plate, by exposure."""

    def factors(self) -> dict[str, Factors]:
        """Return each stimulus's image, view, exposure and luminance scale."""
        return {
            stimulus_name(stimulus.name, view): {
                "image": stimulus.name,
                "view": view,
                "exposure_s": stimulus.exposure_s,
                "luminance_scale": stimulus.luminance_scale,
            }
            for stimulus, view in product(self.stimuli, self.views)
        }

    def faults(self) -> Iterator[RecipeFault]:
        """Yield names and views that stand twice, and what of the plate cannot be rendered."""
        yield from twin_names((stimulus.name for stimulus in self.stimuli), "stimuli")
        yield from twin_views(self.views)
        yield from too_large(self.plate, self.camera)
        yield from without_spectra([self.plate], self.lamp, self.further_lamps)

    def tasks(self, context: BuildContext) -> Iterator[Mapping[str, str]]:
        """Yield all pictures together: they show one plate."""
        shared = (
            self.model_dump(mode="json", exclude={"stimuli", "views", "sparkles", "observer"}) | self.observer_key()
        )
        yield {
            stimulus_name(stimulus.name, view): context.key(
                self.sparkles,
                shared=shared,
                view=view,
                exposure_s=stimulus.exposure_s,
                luminance_scale=stimulus.luminance_scale,
            )
            for stimulus, view in product(self.stimuli, self.views)
        }

    def make(self, context: BuildContext, report: Progress, names: Collection[str]) -> Iterator[MadePicture]:
        """Yield the stimuli of ``names``.

        Each viewpoint's sparkles are rendered once, and each exposure of them is developed once, however many stimuli
        show them.
        """
        from extensions.sparkle.studio import Studio

        scene = self.plate, self.lamp, self.camera, self.seed, context.pixel_pitch_mm, self.further_lamps
        studio = Studio(*scene, observer=str(self.observer))
        factors = self.factors()
        wanted = [
            (spec, view) for spec, view in product(self.stimuli, self.views) if stimulus_name(spec.name, view) in names
        ]
        for done, (stimulus, view) in enumerate(wanted):
            name = stimulus_name(stimulus.name, view)
            report(f"rendering {name}", done, len(wanted))
            scale = np.float32(stimulus.luminance_scale)
            eyes: list[XYZImage] = [
                photograph.xyz_cd_m2 * scale for photograph in studio.photographs(view, stimulus.exposure_s)
            ]
            steps = (
                *studio.steps(view, stimulus.exposure_s),
                {"step": "scale", "luminance_scale": stimulus.luminance_scale},
            )
            yield MadePicture(name, StereoImage(eyes[0], eyes[-1]), factors[name], steps)
        report("done", len(wanted), len(wanted))


def too_large(plate: PaintedPlateSpec, camera: Camera, flakes: Path_ = ("plate", "flakes")) -> Iterator[RecipeFault]:
    """Yield what of the plate would not fit into memory; the place of its flakes in the recipe is ``flakes``."""
    area_mm2 = plate.size_mm[0] * plate.size_mm[1]
    if area_mm2 * plate.flakes.per_mm2 > MAX_FLAKES:
        yield RecipeFault(
            (*flakes, "per_mm2"),
            f"the plate has more than {MAX_FLAKES // 10**6} million flakes",
            "make it smaller or its flakes fewer",
        )
    if area_mm2 * camera.resolution_px_per_mm**2 > MAX_CAMERA_PIXELS:
        yield RecipeFault(
            ("camera", "resolution_px_per_mm"),
            f"the plate covers more than {MAX_CAMERA_PIXELS // 10**6} million camera pixels",
            "make it smaller or the resolution lower",
        )


def without_spectra(
    plates: Iterable[PaintedPlateSpec], lamp: Lamp, further_lamps: Iterable[Lamp]
) -> Iterator[RecipeFault]:
    """Yield each lamp that is a chromaticity where a plate has a spectrum: no colour follows from the two."""
    if not any(plate.base.spectrum or plate.flakes.spectrum for plate in plates):
        return
    places: list[tuple[Path_, Lamp]] = [(("lamp",), lamp)]
    places += [(("further_lamps", index), further) for index, further in enumerate(further_lamps)]
    for place, colour in places:
        if not colour.is_spectral:
            message = "the plate has a spectrum, and this lamp has none"
            yield RecipeFault((*place, "chromaticity_xy"), message, "give it a temperature_K or a spectrum")
