"""The experiments and configurations that come with cyclopean, and copies of experiments with all that they name.

In a checkout they are the folders `experiments/` and `configs/`; an installed package carries the same two folders
below its `runner/shipped/`. Nothing is ever written there: who wants to change an experiment copies it.
"""

from __future__ import annotations

import importlib.resources
import os
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from os.path import isabs
from pathlib import Path
from typing import TYPE_CHECKING

from documents import Finding, InputError
from documents.files import beside, looked_for, whole_folder
from documents.text import did_you_mean
from documents.yaml import read_yaml
from runner.errors import SessionError

if TYPE_CHECKING:
    from runner.protocol.experiment import Experiment


@dataclass(frozen=True, slots=True)
class CopiedExperiment:
    """Where the files of a copy lie: ``files`` are all of them; ``observers`` are simulated ones who can answer it."""

    experiment: Path
    recipe: Path
    rig: Path
    observers: tuple[Path, ...]
    files: tuple[Path, ...]


def shipped_folder() -> Path:
    """Return the folder that holds the shipped ``experiments`` and ``configs``; it may be read-only.

    Returns
    -------
    pathlib.Path
        The checkout, or a folder of the installed package.

    Examples
    --------
    >>> (shipped_folder() / "configs" / "observers" / "table_4_4.yaml").is_file()
    True
    """
    installed = Path(str(importlib.resources.files("runner"))) / "shipped"
    return installed if installed.is_dir() else installed.parents[1]


def shipped_experiments() -> dict[str, Path]:
    """Return the experiments that come with cyclopean, by name.

    Returns
    -------
    dict
        The experiment file of each name, in alphabetical order.

    Examples
    --------
    >>> list(shipped_experiments())
    ['dynamic_range', 'exposure_series', 'paints', 'preliminary']
    """
    return {file.stem: file for file in sorted((shipped_folder() / "experiments").glob("*.yaml"))}


def shipped_experiment(name: str) -> Path:
    """Return the file of the experiment ``name`` that comes with cyclopean.

    Parameters
    ----------
    name
        Its name, such as ``dynamic_range``.

    Returns
    -------
    pathlib.Path
        The experiment file; it may be read-only.

    Raises
    ------
    InputError
        If there is none of that name; the remedy names the nearest, or all.

    Examples
    --------
    >>> shipped_experiment("dynamic_range").name
    'dynamic_range.yaml'
    """
    shipped = shipped_experiments()
    if name not in shipped:
        what = f"no experiment '{name}' comes with cyclopean"
        raise SessionError(Finding(what, remedy=did_you_mean(name, list(shipped), None)))
    return shipped[name]


def copy_experiment(experiment: str | Path, folder: str | Path) -> CopiedExperiment:
    """Copy an experiment with everything that it names: rig, display, recipe, pictures, camera.

    The files keep their places relative to each other, so that every path in them still leads to the copy; the topmost
    folder that holds them all becomes ``folder``. A file that is named by an absolute path stays where it is. With a
    shipped experiment go the simulated observers who can answer it.

    Parameters
    ----------
    experiment
        An experiment file, such as one of `shipped_experiments`.
    folder
        The folder to make; there is none yet, or it is empty.

    Returns
    -------
    CopiedExperiment
        Where the copied files lie, in ``folder``.

    Raises
    ------
    InputError
        If the experiment or a file that it names is wrong or missing, or ``folder`` holds something.
    OSError
        If the copy cannot be written; nothing is then left in ``folder``.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as place:
    ...     copied = copy_experiment(shipped_experiment("dynamic_range"), Path(place) / "my_study")
    ...     copied.experiment.relative_to(place).as_posix(), [file.stem for file in copied.observers]
    ('my_study/experiments/dynamic_range.yaml', ['careless', 'image_based', 'table_4_4'])
    """
    from runner.protocol.experiment import read_experiment

    read, folder = read_experiment(experiment), Path(folder)
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        remedy = "nothing is overwritten: name a folder that is not there yet"
        raise SessionError(Finding("this is there already", str(folder), remedy=remedy))
    observers = [Path(os.path.abspath(file)) for file in _observers(read)]
    beside_it = [Path(os.path.abspath(file)) for file, absolute in named_files(read) if not absolute]
    files = list(dict.fromkeys([*beside_it, *observers]))
    if missing := [file for file in files if not file.is_file()]:
        raise SessionError([Finding("there is no such file", str(file), remedy=looked_for(file)) for file in missing])
    top = os.path.commonpath([file.parent for file in files])

    def place(file: str | Path) -> Path:
        whole = Path(os.path.abspath(file))
        return folder / whole.relative_to(top) if whole in files else Path(file)

    with whole_folder(folder) as draft:
        for file in files:
            copy = draft / file.relative_to(top)
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(file, copy)
    return CopiedExperiment(
        place(read.file),
        place(read.recipe_file),
        place(read.rig.file),
        tuple(map(place, observers)),
        tuple(map(place, files)),
    )


def named_files(experiment: Experiment) -> Iterator[tuple[Path, bool]]:
    """Yield every file that the experiment consists of, its own first, and whether an absolute path leads there."""
    from stimuli.recipes import read_recipe

    rig, recipe = Path(experiment.rig.file), experiment.recipe_file
    of_rig = read_yaml(rig).data
    named = [(experiment.file, experiment.spec.rig), (experiment.file, experiment.spec.stimuli)]
    keys = ("display", "photodiode_verification")
    named += [(rig, of_rig[key]) for key in keys if isinstance(of_rig.get(key), str)]
    named += [(recipe, name) for name in read_recipe(recipe)[0].inputs()]
    style = experiment.spec.style.text
    named += [(experiment.file, style.font)] if style and style.font else []
    yield experiment.file, False
    beyond = {file for file, name in ((rig, experiment.spec.rig), (recipe, experiment.spec.stimuli)) if isabs(name)}
    for file, name in named:
        yield beside(file, name), isabs(name) or file in beyond


def _observers(experiment: Experiment) -> Iterator[Path]:
    """Yield the shipped simulated observers who can answer a shipped experiment."""
    from runner.observers.observer_file import read_observer

    shipped = shipped_folder()
    if experiment.file.resolve().parent != (shipped / "experiments").resolve():
        return
    reference = experiment.stimuli.reference
    for file in sorted((shipped / "configs" / "observers").glob("*.yaml")):
        try:
            read_observer(file, experiment.scored_names, reference)
        except InputError:
            continue
        yield file
