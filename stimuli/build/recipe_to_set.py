"""From a recipe to a stimulus set, built once: the cache is keyed by everything that the pictures depend on.

A set is found by the key of all its pictures together. Where there is none, each picture whose own key another set has
is taken from there, so that changing one stimulus makes one picture. A build works in a folder of its own, whose name
begins with a dot, and the set appears as a whole when all is there. What a killed build had finished stays in that
folder, and the next build resumes there; what a build had finished before it met wrong input is removed.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

from documents import Finding, InputError
from documents.extensions import version_of
from documents.files import sha256_of_json, unwritable
from documents.yaml import YamlSource
from stimuli.build.cache import OTHER_CACHE, cache_folder, locked
from stimuli.build.known_hashes import KnownHashes
from stimuli.build.stimulus_set import StimulusSet, read_stimulus_set
from stimuli.errors import StimulusError
from stimuli.recipes.build_context import BuildContext, DisplaySetup, Progress
from stimuli.recipes.recipe import RECIPES, faults_of_inputs, read_recipe, unreadable
from stimuli.recipes.recipe_kind import RecipeKind

# Raise it when the same recipe makes other pictures than before, or a manifest holds other things.
GENERATOR_VERSION = 4


def build_set(
    recipe_path: Path,
    pixel_pitch_mm: float,
    progress: Progress | None = None,
    *,
    setup: DisplaySetup | None = None,
    jobs: int = 1,
    force: bool = False,
    verify: bool = False,
) -> StimulusSet:
    """Build the stimuli of a recipe for a display, or return them from the cache.

    Parameters
    ----------
    recipe_path
        The recipe: see `read_recipe`.
    pixel_pitch_mm
        The pixel pitch of the display that will show the pictures.
    progress
        Called with what is being done, and how many pictures of how many are done; by one thread at a time.
    setup
        What the display can show, and from where it is seen: needed by recipes that fit pictures to a display's range,
        and used by those that align or resample, to report what their steps mean to an eye.
    jobs
        How many threads make pictures.
    force
        Whether to make all pictures again.
    verify
        Whether to read all pictures of a set in the cache, instead of those that were touched since they were hashed.

    Returns
    -------
    StimulusSet
        The pictures in the cache, in the recipe's order: ``names``, ``factors(name)``, ``load(name)``, ``manifest``.

    Raises
    ------
    InputError
        If the recipe or a picture is wrong, or the cache cannot be written.

    Examples
    --------
    >>> import numpy as np
    >>> from tempfile import TemporaryDirectory
    >>> from stimuli.pictures import StereoImage, write_exr
    >>> stimuli = "[{name: plate, file: plate.exr, factors: {paint: green}}]"
    >>> recipe = f"{{schema_version: 1, kind: pictures, stimuli: {stimuli}}}"
    >>> with TemporaryDirectory() as folder:
    ...     write_exr(Path(folder, "plate.exr"), StereoImage.flat(np.full((4, 6, 3), 5.0, np.float32)))
    ...     _ = Path(folder, "recipe.yaml").write_text(recipe)
    ...     built = build_set(Path(folder, "recipe.yaml"), pixel_pitch_mm=0.2768)
    >>> built.names, built.factors("plate")
    (('plate',), {'image': 'plate', 'paint': 'green', 'view': 'flat'})
    >>> built.load("plate").left[0, 0].tolist()
    [5.0, 5.0, 5.0]
    """
    recipe_path = Path(recipe_path)
    if not (math.isfinite(pixel_pitch_mm) and pixel_pitch_mm > 0):
        raise StimulusError(f"pixel_pitch_mm is {pixel_pitch_mm}; it must be a finite number above 0")
    recipe, source = read_recipe(recipe_path)
    if setup is not None and (mixed := other_observer(str(recipe.observer), setup.observer)):
        raise StimulusError(source.finding(("observer",), *mixed))
    cache = cache_folder()
    hashes = KnownHashes(cache / f".inputs-{sha256_of_json(str(recipe_path.absolute()))[:16]}.json", verify=verify)
    inputs = _inputs(recipe, source, recipe_path, hashes)
    offer = RECIPES.offer(recipe.kind)
    extension = {} if offer is None else {offer.package: version_of(offer)}
    resolved = {
        "generator_version": GENERATOR_VERSION,
        "recipe": recipe.model_dump(mode="json"),
        "pixel_pitch_mm": float(pixel_pitch_mm),
        "inputs": inputs,
        **recipe.display_facts(setup),
        **recipe.decoder_facts(),
        **({"extension": extension} if extension else {}),
    }
    folder = cache / sha256_of_json(resolved)[:32]
    built = None if force else read_stimulus_set(folder, recipe_path, verify=verify)
    if built is not None:
        hashes.keep()
        return built
    # Only to make pictures: a cache hit needs none of it.
    from stimuli.build.builder import Builder, publish

    context = BuildContext(recipe_path.parent, inputs, float(pixel_pitch_mm), setup, GENERATOR_VERSION, extension)
    try:
        cache.mkdir(parents=True, exist_ok=True)
        with locked(folder):
            built = None if force else read_stimulus_set(folder, recipe_path, verify=verify)
            if built is None:
                builder = Builder(recipe, context, folder, progress, force)
                entries = builder.build(jobs)
                publish(entries, resolved, folder, builder.unfinished)
                built = read_stimulus_set(folder, recipe_path, just_built=True)
                if built is None:
                    raise StimulusError(Finding("the stimuli were written but read back otherwise", str(folder)))
                built = replace(built, rendered=builder.made)
            hashes.keep()
            return built
    except InputError as error:
        # What is wrong with no one file is wrong with what the recipe asks for.
        findings = (finding if finding.file else replace(finding, file=str(recipe_path)) for finding in error.findings)
        raise StimulusError(tuple(findings)) from error
    except OSError as error:
        raise StimulusError(unwritable(error, cache, "cache of stimuli", elsewhere=OTHER_CACHE)) from error


def other_observer(recipe: str, rig: str) -> tuple[str, str] | None:
    """Return what is wrong, and what to write, where a recipe and a rig are for different colorimetric observers."""
    if recipe == rig:
        return None
    what = f"the pictures are for the observer {recipe}, and the rig for {rig}"
    return what, f"write observer: {rig} in the recipe and make its pictures for it, or take another rig"


def _inputs(recipe: RecipeKind, source: YamlSource, recipe_path: Path, hashes: KnownHashes) -> dict[str, str]:
    """Return the SHA-256 of each file that the recipe names, refusing those that are not there or outside."""
    contents: dict[str, str] = {}
    findings = faults_of_inputs(recipe, source, recipe_path.parent)
    for file, where in () if findings else recipe.inputs().items():
        try:
            contents[file] = hashes.sha256(recipe_path.parent / file)
        except OSError as error:
            findings.append(unreadable(file, where, source, str(error.strerror)))
        except InputError as error:
            findings.append(unreadable(file, where, source, error.findings[0].message))
    if findings:
        raise StimulusError(findings)
    return contents
