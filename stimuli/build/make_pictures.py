"""Stimuli from files: OpenEXR pictures, and photographs."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from itertools import groupby
from pathlib import Path

from documents import Finding, InputError
from documents.files.tidy_path import tidy
from stimuli.build.display_setup import DisplaySetup
from stimuli.build.made import Made
from stimuli.build.photographs_finish import finished
from stimuli.build.photographs_prepare import Prepared
from stimuli.build.photographs_sources import (
    OneFile,
    Source,
    ViewFiles,
    ViewReader,
    exr_reader,
    photograph_reader,
    spectral_reader,
)
from stimuli.build.progress import Progress
from stimuli.errors import StimulusError
from stimuli.recipes.names import file_pictures
from stimuli.recipes.photographs import DevelopSpec, PhotographSpec, PhotographsRecipe
from stimuli.recipes.recipe import PictureSpec, PicturesRecipe


def make_pictures(
    recipe: PicturesRecipe | PhotographsRecipe,
    folder: Path,
    pixel_pitch_mm: float,
    report: Progress,
    setup: DisplaySetup | None = None,
    names: Collection[str] | None = None,
) -> Iterator[Made]:
    """Yield the recipe's stimuli, or those of ``names``; the files' paths are relative to ``folder``.

    Each stimulus's files are read, and its pair is aligned, once for all series and views that show them. No more than
    one stimulus's views are held at a time.

    Raises
    ------
    InputError
        If a file cannot be read or holds what must not reach an eye, or a step cannot be done: the finding names the
        file, or the stimulus.
    """
    wanted = [one for one in file_pictures(recipe) if names is None or one.name in names]
    specs: tuple[PictureSpec | PhotographSpec, ...] = recipe.stimuli
    done = 0
    for index, pictures in groupby(wanted, key=lambda one: one.stimulus):
        spec = specs[index]
        steps = spec.steps_over(recipe)
        prepared = Prepared(_source(recipe, spec, folder), steps, spec.flat_eye, pixel_pitch_mm, setup)
        for picture in pictures:
            report(f"making {picture.name}", done, len(wanted))
            try:
                image, before = prepared.picture(picture.view)
                image, after = finished(image, steps, picture.series, pixel_pitch_mm, setup)
            except InputError as error:
                raise StimulusError([_named(one, spec.name) for one in error.findings]) from error
            factors = {"view": "flat" if image.is_flat else "stereo"} | dict(picture.factors)
            yield Made(picture.name, image, factors, (*before, *after))
            done += 1
    report("done", done, done)


def _source(recipe: PicturesRecipe | PhotographsRecipe, spec: PictureSpec | PhotographSpec, folder: Path) -> Source:
    if isinstance(spec, PictureSpec):
        return OneFile(
            folder / spec.file,
            spec.file,
            spec.flat_eye,
            spec.colour_space,
            spec.white_luminance_cd_m2,
            spec.negative,
        )
    if spec.file is not None:
        return OneFile(folder / spec.file, spec.file, spec.flat_eye)
    assert isinstance(recipe, PhotographsRecipe)
    return ViewFiles(
        {view: folder / file for view, file in spec.files.items()}, _reader(recipe, spec, folder), spec.flat_eye
    )


def _reader(recipe: PhotographsRecipe, spec: PhotographSpec, folder: Path) -> ViewReader:
    if recipe.camera is not None:
        from devices.camera.camera_file import read_camera

        exposure = None if spec.exposure is None else spec.exposure.exposure()
        return photograph_reader(read_camera(tidy(folder / recipe.camera)), recipe.develop or DevelopSpec(), exposure)
    return exr_reader if recipe.spectral is None else spectral_reader(recipe.spectral, folder)


def _named(finding: Finding, stimulus: str) -> Finding:
    """Return the finding with the stimulus in place of a file, where it names none."""
    if finding.file is not None:
        return finding
    return Finding(f"the stimulus '{stimulus}': {finding.message}", remedy=finding.remedy)
