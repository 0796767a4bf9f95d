"""From a recipe to a stimulus set, built once: the cache is keyed by everything that the pictures depend on."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from documents import Finding
from documents.yaml_source import YamlSource
from stimuli.errors import StimulusError
from stimuli.exr import write_exr
from stimuli.make_pictures import Made, make_pictures
from stimuli.make_plate import make_plate
from stimuli.make_series import make_series
from stimuli.recipe import AnyRecipe, PicturesRecipe, SparklePlateRecipe, read_recipe
from stimuli.stereo_image import StereoImage
from stimuli.stimulus_set import (
    MANIFEST,
    StimulusSet,
    digest_of,
    read_stimulus_set,
    sha256_of_file,
    sha256_of_json,
)

__all__ = ["Progress", "StimulusSet", "build", "cache_folder"]

# Raise it when the same recipe makes other pictures than before.
GENERATOR_VERSION = 1

Progress = Callable[[str, int, int], None]


def cache_folder() -> Path:
    """Return where stimulus sets are kept: ``CYCLOPEAN_CACHE``, else ``cyclopean/stimuli`` in the user's cache."""
    own = os.environ.get("CYCLOPEAN_CACHE")
    if own:
        return Path(own)
    home = os.environ.get("XDG_CACHE_HOME")
    return (Path(home) if home else Path.home() / ".cache") / "cyclopean" / "stimuli"


def build(recipe_path: Path, pixel_pitch_mm: float, progress: Progress | None = None) -> StimulusSet:
    """Build the stimuli of the recipe at ``recipe_path`` for a display, or find them built.

    ``progress`` is called with what is being done, and how many pictures of how many are done. The set appears in the
    cache as a whole: an interrupted build leaves none, and two builds at once make one.

    Raises
    ------
    InputError
        If the recipe or a picture is wrong, or the cache cannot be written.
    """
    recipe_path = Path(recipe_path)
    if not (np.isfinite(pixel_pitch_mm) and pixel_pitch_mm > 0):
        raise StimulusError(f"pixel_pitch_mm is {pixel_pitch_mm}; it must be a finite number above 0")
    recipe, source = read_recipe(recipe_path)
    inputs = _inputs(recipe, source, recipe_path)
    resolved = {
        "generator_version": GENERATOR_VERSION,
        "recipe": recipe.model_dump(mode="json"),
        "pixel_pitch_mm": float(pixel_pitch_mm),
        "inputs": inputs,
    }
    key = sha256_of_json(resolved)
    folder = cache_folder() / key[:32]
    found = read_stimulus_set(folder, recipe_path)
    if found is not None:
        return found
    from filelock import FileLock

    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with FileLock(folder.with_name(f"{folder.name}.lock")):
            found = read_stimulus_set(folder, recipe_path)
            return found or _build(recipe, recipe_path, resolved, folder, progress)
    except OSError as error:
        raise StimulusError(
            Finding(f"the stimuli cannot be kept: {error.strerror or error}", str(folder.parent))
        ) from error


def _inputs(recipe: AnyRecipe, source: YamlSource, recipe_path: Path) -> dict[str, str]:
    """Return the SHA-256 of each file that the recipe names, refusing those that are not there."""
    if not isinstance(recipe, PicturesRecipe):
        return {}
    contents: dict[str, str] = {}
    findings = []
    for index, picture in enumerate(recipe.stimuli):
        if picture.file in contents:
            continue
        try:
            contents[picture.file] = sha256_of_file(recipe_path.parent / picture.file)
        except OSError as error:
            place = source.place(("stimuli", index, "file"))
            line, column = (place.line, place.column) if place else (None, None)
            message = f"the picture '{picture.file}' cannot be read: {error.strerror}"
            findings.append(Finding(message, source.file, line, column, "check the path, relative to the recipe"))
    if findings:
        raise StimulusError(findings)
    return contents


def _build(
    recipe: AnyRecipe,
    recipe_path: Path,
    resolved: dict[str, Any],
    folder: Path,
    progress: Progress | None,
) -> StimulusSet:
    # Nobody else builds this set now: what lies here under its name is broken, or of a build that was killed.
    for leftover in folder.parent.glob(f".{folder.name}-*"):
        shutil.rmtree(leftover)
    temporary = Path(tempfile.mkdtemp(prefix=f".{folder.name}-", dir=folder.parent))
    try:
        report = progress or (lambda doing, done, total: None)
        if isinstance(recipe, SparklePlateRecipe):
            made = make_plate(recipe, resolved["pixel_pitch_mm"], report)
        elif isinstance(recipe, PicturesRecipe):
            made = make_pictures(recipe, recipe_path.parent, report)
        else:
            made = make_series(recipe, resolved["pixel_pitch_mm"], report)
        entries = [_write(picture, temporary) for picture in made]
        manifest = {
            "schema_version": 1,
            **resolved,
            "stimuli": entries,
            "digest": digest_of(entries),
        }
        (temporary / MANIFEST).write_text(json.dumps(manifest, indent=1, allow_nan=False) + "\n", encoding="utf-8")
        if folder.exists():
            shutil.rmtree(folder)
        temporary.chmod(0o755)
        temporary.rename(folder)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
    built = read_stimulus_set(folder, recipe_path)
    if built is None:
        raise StimulusError(Finding("the stimuli were written but read back otherwise", str(folder)))
    return replace(built, rendered=len(entries))


def _write(made: Made, folder: Path) -> dict[str, Any]:
    file = f"{made.name}.exr"
    write_exr(folder / file, made.image)
    return {
        "name": made.name,
        "file": file,
        "sha256": sha256_of_file(folder / file),
        "flat": made.image.is_flat,
        "size_px": [made.image.width_px, made.image.height_px],
        "factors": dict(made.factors),
        "luminance_cd_m2": {eye: _statistics(made.image, eye) for eye in ("left", "right")},
        "steps": list(made.steps),
    }


def _statistics(image: StereoImage, eye: str) -> dict[str, float]:
    luminance = (image.left if eye == "left" else image.right)[..., 1]
    return {"mean": float(luminance.mean(dtype=np.float64)), "max": float(luminance.max())}
