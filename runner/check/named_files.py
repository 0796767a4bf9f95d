"""What is wrong in the files that an experiment names, even where the experiment itself cannot be read."""

from __future__ import annotations

from pathlib import Path

from devices.display.rig_file import read_rig
from documents import Finding, InputError
from documents.files.tidy_path import beside
from documents.yaml.source import read_yaml
from stimuli.recipes.recipe import read_recipe, unreadable


def faults_of_named_files(experiment_file: Path) -> list[Finding]:
    """Return the faults of the rig and the recipe that ``experiment_file``, which may be wrong itself, names."""
    data = read_yaml(experiment_file).data
    findings: list[Finding] = []
    for key, faults in (("rig", _rig_faults), ("stimuli", missing_pictures)):
        name = data.get(key) if isinstance(data, dict) else None
        if isinstance(name, str) and (named := beside(experiment_file, name)).is_file():
            findings += faults(named)
    return findings


def missing_pictures(recipe_file: Path) -> list[Finding]:
    """Return the faults of a recipe, and the files it names that are not there."""
    try:
        recipe, source = read_recipe(recipe_file)
    except InputError as error:
        return list(error.findings)
    findings = []
    for file, where in recipe.inputs().items():
        if not (recipe_file.parent / file).is_file():
            findings.append(unreadable(file, where, source, "there is no such file"))
    return findings


def _rig_faults(file: Path) -> list[Finding]:
    try:
        read_rig(file)
    except InputError as error:
        return list(error.findings)
    return []
