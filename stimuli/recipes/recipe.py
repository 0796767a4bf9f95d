"""Recipes: `configs/stimuli/*.yaml`: which pictures an experiment shows, and how they are made.

Two kinds are the core's: `photographs` develops a camera's files, and `pictures` takes OpenEXR files and ordinary
pictures; others, such as our `sparkle_plate` and `sparkle_series`, are in entry points (`docs/extend.md`). A recipe and
the pictures that it names form one folder that can be copied as a whole: a picture's path is relative to the recipe,
and neither absolute nor upwards (`..`), nor a link that leads out of the folder. A camera file may lie anywhere.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from documents import Finding, InputError, load_document
from documents.extensions import Registry, of_base
from documents.files import beside, inside, looked_for, open_regular
from documents.yaml import ByKind, OneOf, Path_, YamlSource
from stimuli.errors import StimulusError
from stimuli.pictures.picture_input import MAX_SPECTRAL_BYTES
from stimuli.recipes.recipe_kind import RecipeKind

RECIPES: Registry[type[RecipeKind]] = Registry(
    "cyclopean.recipes",
    {
        "pictures": "stimuli.recipes.pictures:PicturesRecipe",
        "photographs": "stimuli.recipes.photographs:PhotographsRecipe",
    },
    of_base(RecipeKind),
)


class Recipe(OneOf[Annotated[RecipeKind, ByKind(RECIPES)]]):
    """A recipe of any kind."""


def read_recipe(path: Path) -> tuple[RecipeKind, YamlSource]:
    """Read the recipe at ``path``.

    Parameters
    ----------
    path
        A YAML file of one of the kinds of `RECIPES`, such as ``pictures``.

    Returns
    -------
    tuple[RecipeKind, YamlSource]
        The recipe, and its source, with which later findings name lines.

    Raises
    ------
    InputError
        If the file cannot be read or is no valid recipe; one finding per fault.

    Examples
    --------
    >>> recipe, _ = read_recipe(Path("configs/stimuli/exposure_series.yaml"))
    >>> recipe.factors()["HI-grey-4"]
    {'paint': 'HI', 'series': 'grey', 'exposure_s': 4.0, 'view': 'stereo'}
    """
    document, source = load_document(path, Recipe, "recipe")
    recipe = document.root
    with RECIPES.blamed(recipe.kind):
        findings = [source.finding(fault.location, fault.message, fault.remedy) for fault in recipe.faults()]
    if findings:
        raise StimulusError(findings)
    return recipe, source


def unreadable(file: str, where: Path_, source: YamlSource, reason: str) -> Finding:
    """Return the finding on a ``file``, named in the recipe at ``where``, that cannot be read.

    Parameters
    ----------
    file
        The file as the recipe names it.
    where
        The keys and places that lead to it in the recipe, such as ``("stimuli", 0)``.
    source
        The recipe's text, which `read_recipe` returns.
    reason
        Why the file cannot be read, without a full stop.

    Returns
    -------
    Finding
        The fault, with the recipe's file, line and column.

    Examples
    --------
    >>> _, source = read_recipe(Path("configs/stimuli/preliminary.yaml"))
    >>> unreadable("car.exr", ("stimuli", 0), source, "there is no such file").message
    "the picture 'car.exr' cannot be read: there is no such file"
    """
    what = "picture" if where[0] == "stimuli" else "file"
    message = f"the {what} '{file}' cannot be read: {reason}"
    path = beside(Path(source.file), file)
    return source.finding(where, message, "check that it may be read" if path.is_file() else looked_for(path))


def faults_of_inputs(recipe: RecipeKind, source: YamlSource, folder: Path) -> list[Finding]:
    """Return what is wrong with the files that a recipe names, before any is read.

    Parameters
    ----------
    recipe, source
        The recipe and its text, which `read_recipe` returns.
    folder
        The recipe's folder.

    Returns
    -------
    list[Finding]
        A finding for each file that is missing, no regular file, or led out of the folder by a link.

    Examples
    --------
    >>> recipe, source = read_recipe(Path("configs/stimuli/preliminary.yaml"))
    >>> faults_of_inputs(recipe, source, Path("configs/stimuli"))
    []
    """
    findings = []
    for file, where in recipe.inputs().items():
        path = folder / file
        try:
            if not path.exists():
                findings.append(unreadable(file, where, source, "there is no such file"))
                continue
            open_regular(path, "file", limit_bytes=MAX_SPECTRAL_BYTES).close()
            if file not in recipe.may_lie_outside():
                inside(folder, path)
        except InputError as error:
            findings += [source.finding(where, f"'{file}': {fault.message}", fault.remedy) for fault in error.findings]
    return findings
