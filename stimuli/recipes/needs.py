"""What a recipe's pictures depend on beside the recipe: files, and what there is of the display.

Apart from what makes pictures, so that a set that is found loads none of it.
"""

from __future__ import annotations

from typing import Any

from documents import Finding
from documents.yaml.source import YamlSource
from stimuli.build.display_setup import DisplaySetup
from stimuli.recipes.photographs import PhotographsRecipe
from stimuli.recipes.recipe import AnyRecipe, PicturesRecipe


def needed_setup(recipe: AnyRecipe, setup: DisplaySetup | None) -> dict[str, Any]:
    """Return of ``setup`` what the recipe's pictures, or their steps, depend on."""
    if setup is None or not isinstance(recipe, (PicturesRecipe, PhotographsRecipe)):
        return {}
    all_steps = [one.steps_over(recipe) for one in recipe.stimuli]
    needed: dict[str, Any] = {}
    if any(steps.align or steps.toe_in or steps.resample for steps in all_steps):
        needed["viewing"] = setup.viewing_json()
    if any(steps.tone_map for steps in all_steps):
        needed["range"] = setup.range_json()
    return needed


def input_files(recipe: AnyRecipe) -> dict[str, tuple[str | int, ...]]:
    """Return each file that the recipe names, with the place in it that names it first."""
    files: dict[str, tuple[str | int, ...]] = {}
    if isinstance(recipe, PicturesRecipe):
        for index, picture in enumerate(recipe.stimuli):
            files.setdefault(picture.file, ("stimuli", index, "file"))
    elif isinstance(recipe, PhotographsRecipe):
        if recipe.camera is not None:
            files[recipe.camera] = ("camera",)
        if recipe.spectral is not None and (recipe.spectral.illuminant or "").lower().endswith(".csv"):
            files[str(recipe.spectral.illuminant)] = ("spectral", "illuminant")
        for index, one in enumerate(recipe.stimuli):
            for key, file in one.files.items():
                files.setdefault(file, ("stimuli", index, key))
    return files


def unreadable(file: str, where: tuple[str | int, ...], source: YamlSource, reason: str) -> Finding:
    """Return what to say of a ``file``, named in the recipe at ``where``, that cannot be read."""
    place = source.place(where)
    line, column = (place.line, place.column) if place else (None, None)
    what = "picture" if where[0] == "stimuli" else "file"
    message = f"the {what} '{file}' cannot be read: {reason}"
    return Finding(message, source.file, line, column, "check the path, relative to the recipe")
