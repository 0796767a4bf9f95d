"""A copy of an experiment that comes with cyclopean, and what to type next."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import ClassVar

from documents import Finding, InputError, load_document
from documents.text import JsonResult
from runner.protocol import copy_experiment, read_experiment, shipped_experiment, shipped_experiments
from runner.protocol.experiment import ExperimentSpec
from runner.studies.contents import commands, next_steps
from runner.studies.options import StudyOptions


@dataclass(frozen=True, slots=True)
class CopiedStudy(JsonResult):
    """A copied experiment: its file, all files, what to type next, and ``notes`` on what to change; ``of`` names it."""

    folder: Path
    experiment: Path
    files: tuple[Path, ...]
    notes: tuple[str, ...]
    commands: tuple[tuple[str, ...], ...]
    of: str = ""
    json_keys: ClassVar = {"of": None}

    def told(self) -> Iterator[str]:
        """Yield what was copied, what to change, and what to type next."""
        line = f"{self.folder}: a copy of '{self.of}' with everything that it names."
        yield from next_steps(line, self.notes, self.commands)


def shipped_studies() -> dict[str, str]:
    """Return the question of each experiment that comes with cyclopean, by its name.

    Returns
    -------
    dict
        Names for `copy_shipped`, each with what observers are asked.

    Examples
    --------
    >>> shipped_studies()["dynamic_range"]
    'Which image is closer to the reference plate?'
    """
    return {name: load_document(file, ExperimentSpec)[0].question for name, file in shipped_experiments().items()}


def copy_shipped(
    name: str,
    folder: str | Path | None = None,
    pictures: Sequence[Path] = (),
    options: StudyOptions | None = None,
) -> CopiedStudy:
    """Copy an experiment with everything that it names: rig, display, recipe, pictures, simulated observers.

    Parameters
    ----------
    name
        One of `shipped_studies`, or an experiment file.
    folder
        The folder to make; None calls it as the experiment.
    pictures, options
        Those of a study of one's own, which a copy does not take: none, or the default.

    Returns
    -------
    CopiedStudy
        Where the copy is, and the commands that follow.

    Raises
    ------
    InputError
        If there is no such experiment, ``folder`` holds something already, or pictures or options are given; nothing
        is written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as place:
    ...     copied = copy_shipped("dynamic_range", Path(place, "my_study"))
    ...     copied.experiment.is_file(), copied.commands[1][:2]
    (True, ('cyclopean', 'run'))
    """
    default = StudyOptions()
    given = [
        f"--{one.name.split('_')[0].rstrip('s')}"
        for one in fields(default)
        if options and getattr(options, one.name) != getattr(default, one.name)
    ]
    if pictures or given:
        remedy = f"leave out {', '.join(given) or 'other pictures'}"
        raise InputError(Finding("--from copies an experiment as it is, with its own pictures", remedy=remedy))
    folder = Path(folder or Path(name).stem)
    file = Path(name) if Path(name).suffix in (".yaml", ".yml") else shipped_experiment(name)
    copied = copy_experiment(file, folder)
    experiment = read_experiment(copied.experiment)
    notes = []
    if experiment.rig.nominal is None:
        notes.append(
            f"The rig {copied.rig} describes a display that was measured, which is not yours. "
            "Name your own in it, or write display: {nominal: srgb, white_cd_m2: 100}"
        )
    if copied.observers:
        notes.append(f"To try it without a person, add to 'run': --simulate {copied.observers[-1]}")
    return CopiedStudy(
        folder, copied.experiment, copied.files, tuple(notes), commands(copied.experiment, experiment.spec.name), name
    )
