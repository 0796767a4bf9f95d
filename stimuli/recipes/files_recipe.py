"""The base of recipes of files: one stimulus from a file or several, and the steps until it is shown."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import groupby, product
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from pydantic import AfterValidator, Field, StringConstraints

from devices.colour import delta_e_2000, xyz_to_lab
from documents import Finding, InputError
from documents.yaml import Path_
from stimuli.errors import StimulusError
from stimuli.pictures.colour_spaces import NAMED_SPACES, named_encoding
from stimuli.pictures.stereo_image import Eye
from stimuli.recipes.build_context import BuildContext, DisplaySetup, Factors, MadePicture, Progress
from stimuli.recipes.recipe_kind import RecipeFault, RecipeKind, stimulus_name, twin_names, twin_views
from stimuli.recipes.steps_spec import StepsSpec
from stimuli.recipes.values import MAX_STIMULI, Name, SeriesSpec, SeriesSpecs, Step, View

if TYPE_CHECKING:
    from stimuli.recipes.picture_steps import Prepared
    from stimuli.recipes.view_sources import ViewSource

# Where the steps between the codes of 8 bits will be seen as bands: in pictures that were brightened.
#
# On a display whose white is the picture's, neighbouring greys of 8 bits differ by ΔE00 0.40 at most: what every screen
# shows. Times a factor, the same codes lie further apart. A difference of 1 between patches is just noticeable; bands
# share their whole edge, the arrangement in which least is overlooked, and half of it is where they are named.

VISIBLE_DELTA_E = 0.5


def banding(before: Sequence[Step], after: Sequence[Step]) -> tuple[Step, ...]:
    """Return the step that names bands, or nothing: of 8 bits read ``before``, and brightened ``after``."""
    reads = [step for step in before if step["step"] == "read" and step.get("bits") == 8]
    factor = math.prod(float(step["luminance_scale"]) for step in after if "luminance_scale" in step)
    if not reads or factor <= 1.0:
        return ()
    space, white_cd_m2 = reads[0]["colour_space"], reads[0]["white_luminance_cd_m2"]
    # A profile's own curve is near sRGB's.
    encoding = named_encoding(next((name for name in NAMED_SPACES if name == space), "srgb"))
    luminance = encoding.tables(256)[:, 0] * factor
    lab = xyz_to_lab(luminance[luminance <= 1.0, None] * encoding.white, encoding.white)
    steps = delta_e_2000(lab[:-1], lab[1:])
    worst = int(np.argmax(steps))
    if steps[worst] <= VISIBLE_DELTA_E:
        return ()
    at_cd_m2 = float(luminance[worst]) * white_cd_m2
    sentence = (
        f"brightened {factor:.3g} times, codes of 8 bits are up to ΔE00 {steps[worst]:.2f} apart (at {at_cd_m2:.2g} "
        f"cd/m²), so that smooth shadings may show bands; start from 16 bits"
    )
    facts = {"luminance_factor": factor, "delta_e_00": float(steps[worst]), "luminance_cd_m2": at_cd_m2}
    return ({"step": "banding", **facts, "said": [sentence]},)


def _factor(key: str) -> str:
    if key in ("image", "view", "series"):
        raise ValueError(f"'{key}' is set by the recipe; give the factor another name")
    return key


FactorName = Annotated[str, StringConstraints(pattern=r"^[a-z][a-z0-9_]{0,59}$"), AfterValidator(_factor)]
FactorValue = (
    Annotated[str, StringConstraints(min_length=1, max_length=200)]
    | Annotated[float, Field(strict=True, ge=-1e18, le=1e18)]
)


class FileStimulusSpec(StepsSpec):
    """One stimulus from a file or several.

    ``flat_eye`` makes the flat version where no centre view is; ``factors`` are what sets the stimulus apart, for
    grouping and analysis.
    """

    name: Name
    """A name of your own, by which records and reports call it."""
    flat_eye: Eye | None = None
    """The eye whose view a flat picture takes."""
    factors: Annotated[dict[FactorName, FactorValue], Field(default_factory=dict)]
    """The levels of the stimulus's factors, such as scene: beach."""

    @property
    @abstractmethod
    def files(self) -> dict[str, str]:
        """The files by the key that names them."""

    @abstractmethod
    def stored_view(self) -> View | None:
        """Return how it is shown by default; None if that is not known before the file is read."""


@dataclass(frozen=True, slots=True)
class FilePicture:
    """One picture of a stimulus, which counts from 0: in a series, and in a view."""

    name: str
    stimulus: int
    series: SeriesSpec | None
    view: View | None
    factors: Factors


class FilesRecipe(RecipeKind, StepsSpec):
    """Stimuli from files; with ``views``, each in each of them, and with ``series``, each in each."""

    series: SeriesSpecs | None = None
    """Series that every stimulus is made in."""

    @abstractmethod
    def specs(self) -> Sequence[FileStimulusSpec]:
        """Return the stimuli as the recipe lists them."""

    @abstractmethod
    def source(self, stimulus: int, folder: Path) -> ViewSource:
        """Return the reader of the views of stimulus number ``stimulus``, from 0; paths are relative to ``folder``."""

    def shared_files(self) -> dict[str, Path_]:
        """Return the files that all stimuli depend on, with their places in the recipe."""
        return {}

    def shared_key(self, context: BuildContext) -> dict[str, Any]:
        """Return the values that all pictures depend on beside their own entries, for their keys."""
        return {"needed": self.display_facts(context.setup), **self.observer_key()}

    def own_key(self, spec: FileStimulusSpec) -> dict[str, Any]:
        """Return the values of one stimulus that its pictures depend on."""
        return spec.model_dump(mode="json", exclude={"name", "factors", "view"}) | spec.steps_over(self).steps_json()

    def pictures(self) -> tuple[FilePicture, ...]:
        """Return the pictures: stimulus by stimulus, series by series, view by view."""
        all_series: tuple[SeriesSpec | None, ...] = self.series or (None,)
        views: tuple[View | None, ...] = self.views or (None,)
        pictures = []
        for (index, spec), series, view in product(enumerate(self.specs()), all_series, views):
            name = f"{spec.name}-{series.name}" if series else spec.name
            factors: dict[str, str | float] = {"image": spec.name}
            shown = view or spec.stored_view()
            if series:
                factors["series"] = series.name
            if shown:
                factors["view"] = shown
            pictures.append(FilePicture(stimulus_name(name, view), index, series, shown, {**factors, **spec.factors}))
        return tuple(pictures)

    def factors(self) -> dict[str, Factors]:
        """Return each stimulus's image, series, view and the factors that the recipe gives it."""
        return {picture.name: picture.factors for picture in self.pictures()}

    def faults(self) -> Iterator[RecipeFault]:
        """Yield names and views that stand twice or meet, and too many pictures."""
        names = [spec.name for spec in self.specs()]
        yield from twin_names(names, "stimuli")
        yield from twin_views(self.views)
        series = [named.name for named in self.series or ()]
        yield from twin_names(series, "series")
        made = [
            "-".join(part for part in parts if part).casefold()
            for parts in product(names, series or ("",), self.views or ("",))
        ]
        if len(made) > MAX_STIMULI:
            yield RecipeFault(("stimuli",), f"these are {len(made)} pictures", f"a recipe makes {MAX_STIMULI} at most")
        for name, count in sorted(Counter(made).items()):
            if count > 1 and series:
                yield RecipeFault(("series",), f"two pictures would be called '{name}'", "give one another name")

    def inputs(self) -> dict[str, Path_]:
        """Return each file that the recipe names, with the place in it that names it first."""
        files = self.shared_files()
        for index, spec in enumerate(self.specs()):
            for key, file in spec.files.items():
                files.setdefault(file, ("stimuli", index, key))
        return files

    def display_facts(self, setup: DisplaySetup | None) -> dict[str, Any]:
        """Return the facts of ``setup`` that the steps depend on: the place of the eyes, and the display's range."""
        if setup is None:
            return {}
        all_steps = [spec.steps_over(self) for spec in self.specs()]
        needed: dict[str, Any] = {}
        if any(steps.align or steps.toe_in or steps.resample for steps in all_steps):
            needed["viewing"] = setup.viewing_json()
        if any(steps.tone_map for steps in all_steps):
            needed["range"] = setup.range_json()
        return needed

    def tasks(self, context: BuildContext) -> Iterator[Mapping[str, str]]:
        """Yield each stimulus's pictures: its files are read, and its pair is aligned, once."""
        shared = self.shared_key(context)
        for index, pictures in groupby(self.pictures(), key=lambda picture: picture.stimulus):
            spec = self.specs()[index]
            own = self.own_key(spec)
            yield {
                picture.name: context.key(
                    self.sparkles,
                    shared=shared,
                    own=own,
                    view=picture.view,
                    series=None if picture.series is None else picture.series.key(),
                    contents=[context.file_hashes[file] for file in spec.files.values()],
                )
                for picture in pictures
            }

    def make(self, context: BuildContext, report: Progress, names: Collection[str]) -> Iterator[MadePicture]:
        """Yield the stimuli of ``names``.

        Each stimulus's files are read, and its pair is aligned, once for all series and views that show them. No more
        than one stimulus's views are in memory at a time.

        Raises
        ------
        InputError
            If a file cannot be read or holds what must not reach an eye, or a step cannot be done: the finding names
            the file, or the stimulus.
        """
        from stimuli.recipes.picture_steps import Prepared

        wanted = [picture for picture in self.pictures() if picture.name in names]
        pitch_mm, setup = context.pixel_pitch_mm, context.setup
        done = 0
        for index, pictures in groupby(wanted, key=lambda picture: picture.stimulus):
            spec = self.specs()[index]
            steps = spec.steps_over(self)
            prepared = Prepared(self.source(index, context.folder), steps, spec.flat_eye, pitch_mm, setup)
            for picture in pictures:
                report(f"making {picture.name}", done, len(wanted))
                plainly = partial(self._made, picture, prepared, steps, context)
                if in_bands := prepared.banded(picture.view, picture.series):
                    made = MadePicture(picture.name, in_bands[0], {}, in_bands[1], plainly=plainly)
                else:
                    made = plainly()
                factors = {"view": "flat" if made.image.is_flat else "stereo"} | dict(picture.factors)
                yield replace(made, factors=factors)
                done += 1
        report("done", done, done)

    def _made(self, picture: FilePicture, prepared: Prepared, steps: StepsSpec, context: BuildContext) -> MadePicture:
        """Make a picture at once."""
        from stimuli.recipes.files_recipe import banding
        from stimuli.recipes.picture_steps import finished_picture

        try:
            kept = None if picture.series else prepared.unchanged(picture.view)
            if kept is not None:
                return MadePicture(picture.name, kept.held, {}, kept.steps, kept.exact)
            image, before = prepared.picture(picture.view)
            pitch_mm, setup = context.pixel_pitch_mm, context.setup
            image, after = finished_picture(image, steps, picture.series, pitch_mm, setup, str(self.observer))
            return MadePicture(picture.name, image, {}, (*before, *after, *banding(before, after)))
        except InputError as error:
            name = self.specs()[picture.stimulus].name
            raise StimulusError([_of_stimulus(finding, name) for finding in error.findings]) from error


def _of_stimulus(finding: Finding, stimulus: str) -> Finding:
    """Return the finding with the stimulus in place of a file, where it names none."""
    if finding.file is not None:
        return finding
    return Finding(f"the stimulus '{stimulus}': {finding.message}", remedy=finding.remedy)
