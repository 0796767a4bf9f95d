"""What the schema cannot see: names that stand twice, plates that are too large, changes that do not fit."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product

from pydantic import ValidationError

from documents.yaml.source import Path_
from stimuli.recipes.series_recipe import NamedPlateSpec, SparkleSeriesRecipe
from stimuli.recipes.values import MAX_STIMULI, View
from stimuli.sparkle.recipe import CameraSpec, LampSpec, PlateSpec

# What a plate may ask for: either takes a few GB of memory.
MAX_FLAKES = 50_000_000
MAX_CAMERA_PIXELS = 100_000_000


@dataclass(frozen=True, slots=True)
class Fault:
    """A fault, the place of the value at fault in the recipe, and what would be right."""

    location: Path_
    message: str
    remedy: str


def twin_names(names: Iterable[str], *location: str) -> Iterator[Fault]:
    """Yield each name in the list at ``location`` that stands there before.

    Names become file names, and some file systems do not tell A from a.
    """
    seen: set[str] = set()
    for index, name in enumerate(names):
        if name.casefold() in seen:
            yield Fault((*location, index, "name"), f"the name '{name}' stands twice", "give it another")
        seen.add(name.casefold())


def series_of_pictures_faults(names: Iterable[str], series: Sequence[str], views: Sequence[str]) -> Iterator[Fault]:
    """Yield what is wrong with making each picture in each series and view: twins, too many, names that meet."""
    yield from twin_names(series, "series")
    made = [
        "-".join(part for part in parts if part).casefold() for parts in product(names, series or ("",), views or ("",))
    ]
    if len(made) > MAX_STIMULI:
        yield Fault(("stimuli",), f"these are {len(made)} pictures", f"a recipe makes {MAX_STIMULI} at most")
    for name, count in sorted(Counter(made).items()):
        if count > 1 and series:
            yield Fault(("series",), f"two pictures would be called '{name}'", "give one another name")


def twin_views(views: tuple[View, ...] | None) -> Iterator[Fault]:
    """Yield a fault if a view stands twice."""
    if views and len(set(views)) != len(views):
        yield Fault(("views",), "a view stands twice", "keep one")


def too_large(plate: PlateSpec, camera: CameraSpec, flakes: Path_ = ("plate", "flakes")) -> Iterator[Fault]:
    """Yield what of the plate would not fit into memory; the place of its flakes in the recipe is ``flakes``."""
    area_mm2 = plate.size_mm[0] * plate.size_mm[1]
    if area_mm2 * plate.flakes.per_mm2 > MAX_FLAKES:
        yield Fault(
            (*flakes, "per_mm2"),
            f"the plate has more than {MAX_FLAKES // 10**6} million flakes",
            "make it smaller or its flakes fewer",
        )
    if area_mm2 * camera.resolution_px_per_mm**2 > MAX_CAMERA_PIXELS:
        yield Fault(
            ("camera", "resolution_px_per_mm"),
            f"the plate covers more than {MAX_CAMERA_PIXELS // 10**6} million camera pixels",
            "make it smaller or the resolution lower",
        )


def without_spectra(plates: Iterable[PlateSpec], lamp: LampSpec, further_lamps: Iterable[LampSpec]) -> Iterator[Fault]:
    """Yield each lamp that is a chromaticity where a plate has a spectrum: no colour follows from the two."""
    if not any(plate.base.spectrum or plate.flakes.spectrum for plate in plates):
        return
    places: list[tuple[Path_, LampSpec]] = [(("lamp",), lamp)]
    places += [(("further_lamps", index), one) for index, one in enumerate(further_lamps)]
    for place, one in places:
        if not one.is_spectral:
            message = "the plate has a spectrum, and this lamp has none"
            yield Fault((*place, "chromaticity_xy"), message, "give it a temperature_K or a spectrum")


def series_faults(recipe: SparkleSeriesRecipe) -> Iterator[Fault]:
    """Yield what is wrong with series of exposures."""
    yield from twin_views(recipe.views)
    yield from twin_names((plate.name for plate in recipe.plates), "plates")
    yield from twin_names((series.name for series in recipe.series), "series")
    printed = [f"{exposure_s:g}" for exposure_s in recipe.exposures_s]
    for index, exposure in enumerate(printed):
        if exposure in printed[:index]:
            yield Fault(("exposures_s", index), f"the exposure {exposure} s stands twice", "keep one")
    yield from _twin_pictures(recipe)
    pictures = len(recipe.plates) * len(recipe.series) * len(recipe.exposures_s) * len(recipe.views or "1")
    if pictures > MAX_STIMULI:
        yield Fault(("plates",), f"these are {pictures} pictures", f"a recipe makes {MAX_STIMULI} at most")
    faulty = False
    for index, plate in enumerate(recipe.plates):
        for fault in _plate_faults(plate, index, recipe):
            faulty = True
            yield fault
    if not faulty:
        plates = (plate.over(recipe.plate) for plate in recipe.plates)
        yield from without_spectra(plates, recipe.lamp, recipe.further_lamps)


def _plate_faults(plate: NamedPlateSpec, index: int, recipe: SparkleSeriesRecipe) -> Iterator[Fault]:
    try:
        whole = plate.over(recipe.plate)
    except ValidationError as error:
        message = str(error.errors()[0]["msg"]).removeprefix("Value error, ")
        yield Fault(("plates", index, "flakes"), f"'{plate.name}' and 'plate' do not fit: {message}", "change either")
        return
    changed = plate.flakes.per_mm2 is not None
    for fault in too_large(whole, recipe.camera, ("plates", index, "flakes") if changed else ("plate", "flakes")):
        # What all plates share is told once.
        if index == 0 or fault.location[0] == "plates":
            yield fault


def _twin_pictures(recipe: SparkleSeriesRecipe) -> Iterator[Fault]:
    """Yield pictures whose names meet though their parts differ: a-b with c, and a with b-c."""
    pairs = {(plate.name.casefold(), series.name.casefold()) for plate in recipe.plates for series in recipe.series}
    called = Counter(f"{plate}-{series}" for plate, series in pairs)
    for name, count in sorted(called.items()):
        if count > 1:
            yield Fault(("series",), f"two series of pictures would be called '{name}'", "give one another name")
