"""Sessions: check a file, see the screens of an experiment, let simulated observers answer."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from cyclopean.result import Result
from documents.options import made, taking
from runner.studies import StudyOptions

if TYPE_CHECKING:
    from collections.abc import Sequence

    from runner.check import CheckReport
    from runner.reports import Demo
    from runner.studies import Kind, NewStudy


@taking(StudyOptions)
def new_study(folder: str | Path, pictures: Sequence[str | Path], kind: Kind = "pairs", **options: Any) -> NewStudy:
    """Write a study of ordinary pictures, ready to run, as `cyclopean new` does and with the same options.

    Parameters
    ----------
    folder
        The folder to make; nothing is overwritten.
    pictures
        Picture files and folders of them.
    kind
        What observers do: ``pairs``, ``best``, ``rating`` or ``within-groups``.
    **options
        Those of `runner.studies.StudyOptions`, such as ``mode``, ``question`` and ``panel``; a text may stand for a
        panel, such as ``1920x1080,0.2768``.

    Returns
    -------
    NewStudy
        ``experiment`` is its file; ``notes`` say what was decided.

    Raises
    ------
    InputError
        If the folder is there already or a picture cannot be used; nothing is then written.
    """
    from devices.display import read_panel
    from runner.studies import new_study as write_study

    if isinstance(panel := options.get("panel"), str):
        options["panel"] = read_panel(panel)
    return write_study(folder, pictures, made(StudyOptions, {"kind": kind, **options}))


def check(path: str | Path, *, pictures: bool = True) -> Result[CheckReport]:
    """Check a file of any kind with everything it names.

    Parameters
    ----------
    path
        An experiment, display, rig, recipe, camera, simulated observers, regions, or a record of a photodiode.
    pictures
        Whether to build the stimuli of an experiment, to report how much of them a display cannot show.

    Returns
    -------
    Result
        A row for each error and warning, with file, line, column and remedy; ``value.facts`` is what the file says.

    Examples
    --------
    >>> check("configs/displays/asus_vg248qe.yaml")
    <configs/displays/asus_vg248qe.yaml: 0 errors, 0 warnings>
    """
    from dataclasses import asdict

    from runner.check import TRIED_OBSERVERS, CheckOptions, check_file

    options = CheckOptions(screen=False, pictures=pictures, observers=TRIED_OBSERVERS)
    report = check_file(Path(path), options)
    rows: list[dict[str, Any]] = [{"severity": "error", **asdict(finding)} for finding in report.errors]
    rows += [{"severity": "warning", **asdict(finding)} for finding in report.warnings]
    errors, warnings = len(report.errors), len(report.warnings)
    return Result(
        report,
        rows,
        f"{path}: {errors} error{'' if errors == 1 else 's'}, {warnings} warning{'' if warnings == 1 else 's'}",
    )


def preview(experiment: str | Path, folder: str | Path, *, observer: str = "01") -> tuple[Path, ...]:
    """Write every screen that an observer would see to PNG files, one for each eye.

    Parameters
    ----------
    experiment
        An experiment file.
    folder
        Where to write the pictures.
    observer
        Code of the observer, on which the order of trials depends.

    Returns
    -------
    tuple of pathlib.Path
        The files, in the order of the screens.

    Raises
    ------
    InputError
        If a file is wrong or the folder cannot be made.
    """
    from runner.reports import preview as write_screens

    return write_screens(experiment, folder, observer)


def simulate(
    experiment: str | Path,
    observers_file: str | Path,
    folder: str | Path,
    *,
    observers: int = 30,
    seed: int | None = None,
) -> Path:
    """Run an experiment with simulated observers, without a window.

    Parameters
    ----------
    experiment
        An experiment file.
    observers_file
        A file of simulated observers, such as ``configs/observers/table_4_4.yaml``.
    folder
        Where the sessions are written.
    observers
        How many observers; their codes are 01, 02 and so on.
    seed
        Random seed of the answers; that of the experiment if None.

    Returns
    -------
    pathlib.Path
        The folder, for `read_results` and `report`.

    Raises
    ------
    InputError
        If a file is wrong or the folder cannot be written.
    """
    from runner.session import simulate as run_simulated

    run_simulated(experiment, observers_file, observers, results=folder, seed=seed)
    return Path(folder)


def demo(folder: str | Path = "results/demo", *, observers: int = 30) -> Result[Demo]:
    """Repeat the thesis's second experiment with simulated observers, and write a report.

    Parameters
    ----------
    folder
        Folder in which a new one is made for the sessions and the report.
    observers
        Number of simulated observers, who answer by the published scores.

    Returns
    -------
    Result
        A row for each stimulus, best first; ``value.page`` is the report.

    Raises
    ------
    InputError
        If the folder cannot be written.
    """
    from runner.reports import run_demo

    done = run_demo(observers, results=folder)
    pairs = done.report.pairs
    rows = [] if pairs is None else [item.to_json() for item in pairs.scores.items]
    return Result(done, rows, f"Demonstration with {observers} simulated observers; report: {done.page}")
