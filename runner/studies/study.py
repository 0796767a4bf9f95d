"""A new study from pictures, or a copy of one that comes with cyclopean, in a folder that can be moved."""

from __future__ import annotations

import re
import shutil
import unicodedata
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import ClassVar

from devices.display import AskMonitor
from documents import Finding, InputError, counted, load_document
from documents.files import whole_folder
from documents.text import JsonResult, did_you_mean
from runner.check import CheckOptions, check_file
from runner.presenter import find_mode
from runner.presenter.surfaces.screens import primary_monitor
from runner.protocol import Experiment, copy_experiment, read_experiment, shipped_experiment, shipped_experiments
from runner.protocol.experiment import ExperimentSpec
from runner.session.picture_source import Progress, no_progress
from runner.studies.contents import (
    EXPERIMENT,
    KINDS,
    StudyDesign,
    commands,
    copies_of_pictures,
    next_steps,
    written_files,
)
from runner.studies.gather import Grouping, Member, by_folder, gather, groups_of_pairs
from runner.studies.options import StudyOptions
from runner.studies.plan import plan_sizes
from runner.studies.screen import DISTANCE_MM, StudyScreen, nominal_screen, screen_of_file
from runner.views.layout import NO_REFERENCE, PHYSICAL

NO_SPECIAL_SCREEN = "anaglyph-red-cyan"
WHITE_CD_M2 = 100.0


@dataclass(frozen=True, slots=True)
class NewStudy(JsonResult):
    """A study that was written: its experiment file, what to type next, and ``notes`` on what was decided."""

    folder: Path
    experiment: Path
    pictures: int
    mode: str
    trials: int
    minutes: float
    notes: tuple[str, ...]
    commands: tuple[tuple[str, ...], ...]

    def told(self) -> Iterator[str]:
        """Yield how large the study is, what was decided, and what to type next."""
        size = f"{counted(self.pictures, 'picture', 'pictures')}, {counted(self.trials, 'trial', 'trials')}"
        minutes = counted(max(1, round(self.minutes)), "minute", "minutes")
        line = f"{self.folder}: {size}, about {minutes} for each observer."
        yield from next_steps(line, self.notes, self.commands)


def new_study(
    folder: str | Path | None,
    pictures: Sequence[str | Path],
    options: StudyOptions | None = None,
    *,
    ask_monitor: AskMonitor = primary_monitor,
    progress: Progress = no_progress,
) -> NewStudy:
    """Write a study of ordinary pictures that passes `runner.check` and runs: nothing is overwritten or half-written.

    No picture is decoded: sizes and colour spaces are read from the files' headers.

    Parameters
    ----------
    folder
        The folder to make; its name, as far as it can be, becomes the experiment's.
    pictures
        Picture files and folders of them, as `stimuli.pictures.find_pictures` takes them.
    options
        What differs from the default: pairs, on a nominal display.
    ask_monitor
        Called for what the monitor reports of itself, where neither a display file nor a panel is given.
    progress
        Called with what is being done, how much of it is done, and of how much.

    Returns
    -------
    NewStudy
        Where it is, how long a session takes, and the commands that follow.

    Raises
    ------
    InputError
        If no folder or picture is named, the folder holds something already, a picture cannot be used, or an option is
        wrong; nothing is written.
    OSError
        If the disk is full or cannot be written; nothing is left then.

    Examples
    --------
    >>> import numpy as np
    >>> from PIL import Image
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as place:
    ...     for name in ("dim.png", "bright.png", "grey.png"):
    ...         Image.fromarray(np.zeros((40, 60, 3), np.uint8)).save(Path(place, name))
    ...     study = new_study(Path(place, "my_study"), sorted(Path(place).glob("*.png")))
    ...     study.mode, study.trials, sorted(file.name for file in study.folder.iterdir())[:3]
    ('flat', 3, ['README.md', 'experiment.yaml', 'pictures'])
    """
    if folder is None or not pictures:
        photos = folder is not None and Path(folder).exists()
        words = f"my_study {folder}" if photos else f"{folder or 'my_study'} photos/"
        raise InputError(Finding("no folder to make and pictures are named", remedy=f"cyclopean new {words}"))
    folder, options = Path(folder), options or StudyOptions()
    _refuse_present(folder)
    progress("reading the pictures' headers", 0, 1)
    design = _design(folder, gather([Path(path) for path in pictures]), options, ask_monitor)
    copies = copies_of_pictures(design) | dict(design.screen.copies)
    files = written_files(design)
    try:
        with whole_folder(folder) as draft:
            for name, text in files.items():
                (draft / name).write_bytes(text.encode("utf-8"))
            for name, source in design.screen.copies.items():
                shutil.copyfile(source, draft / name)
            (draft / "pictures").mkdir()
            for done, (name, source) in enumerate(copies.items()):
                progress("copying the pictures", done, len(copies))
                shutil.copyfile(source, draft / name)
            progress("copying the pictures", len(copies), len(copies))
            experiment = _checked(draft, folder)
    except FileExistsError:
        _refuse_present(folder)
        raise
    blocks = list(zip(experiment.spec.blocks, experiment.example_blocks, strict=True))
    minutes = round(sum(block.expected_s for _, block in blocks) / 60, 1)
    return NewStudy(
        folder,
        folder / EXPERIMENT,
        len(design.members),
        design.mode,
        sum(block.trials for spec, block in blocks if spec.kind != "practice"),
        minutes,
        design.notes,
        commands(folder / EXPERIMENT, design.label),
    )


def _compared(members: Sequence[Member], grouping: Grouping | None) -> list[list[int]]:
    """Return the numbers of the pictures that are compared with each other, by group."""
    groups = grouping.members.values() if grouping else [tuple(member.name for member in members)]
    compared = [[number for number, member in enumerate(members) if member.name in names] for names in groups]
    others = set(range(len(members))) - {number for group in compared for number in group}  # a reference of all groups
    return [*compared, *([number] for number in others)]


def _design(folder: Path, members: tuple[Member, ...], options: StudyOptions, ask_monitor: AskMonitor) -> StudyDesign:
    """Decide on mode, groups, sizes and light."""
    kind = options.kind
    members, reference = _with_reference(members, options.reference)
    judged = tuple(member for member in members if member.name != reference)
    if kind not in KINDS:
        raise InputError(Finding(f"there is no kind of study '{kind}'", remedy=did_you_mean(kind, KINDS)))
    if len(judged) < 2 and kind != "rating":
        message = "one picture is nothing to compare"
        raise InputError(Finding(message, remedy="name two or more, or have it rated: --kind rating"))
    if options.display is None:
        screen = nominal_screen(options.panel, None if options.panel else ask_monitor(options.monitors))
    elif options.panel is not None:
        raise InputError(Finding("the display file states the panel", remedy="leave out --display or --panel"))
    else:
        screen = screen_of_file(options.display)
    mode = _mode(members, options.mode, screen)
    white = screen.white_cd_m2.get(mode, WHITE_CD_M2) if options.white_cd_m2 is None else options.white_cd_m2
    if not 0 < white < 100_000:
        raise InputError(Finding(f"a white of {white:g} cd/m² is none", remedy="such as --white 100"))
    distance_mm = (screen.distance_mm or DISTANCE_MM) if options.distance_mm is None else options.distance_mm
    grouping = groups_of_pairs(judged) if kind == "within-groups" else by_folder(judged) if kind == "best" else None
    plan = plan_sizes(
        [member.picture.size_px for member in members],
        find_mode(mode),
        screen.panel,
        pairs=kind in ("pairs", "within-groups"),
        with_reference=len(judged) < len(members),
        fit=options.fit,
        compared=_compared(members, grouping),
    )
    called = folder.absolute().name
    return StudyDesign(
        called,
        _label(called),
        replace(options, question=_line(options.question), reference=reference),
        members,
        grouping,
        plan,
        screen,
        mode,
        white,
        distance_mm,
    )


def _with_reference(members: tuple[Member, ...], reference: str | None) -> tuple[tuple[Member, ...], str | None]:
    """Return the pictures with the one that ``reference`` names, if it is a file, and what the layout calls it."""
    if reference is None or reference == PHYSICAL:
        return members, reference
    (named,) = gather([Path(reference)])
    for member in members:
        if _files(member) == _files(named):
            return members, member.name
    if named.name in {member.name for member in members} | {NO_REFERENCE, PHYSICAL}:
        named = replace(named, picture=replace(named.picture, name=f"{named.name}-reference"))
    return (*members, named), named.name


def _files(member: Member) -> set[Path]:
    picture = member.picture
    return {file.resolve() for file in (picture.file, picture.left, picture.right) if file}


def _mode(members: Sequence[Member], wanted: str | None, screen: StudyScreen) -> str:
    """Return the stereo mode.

    Raises
    ------
    InputError
        If there is no such mode, the display was not measured in it, or it cannot show stereo pictures.
    """
    stereo = [member for member in members if member.picture.stereo]
    mode = wanted or screen.mode or (NO_SPECIAL_SCREEN if stereo else "flat")
    find_mode(mode)
    if screen.white_cd_m2 and mode not in screen.white_cd_m2:
        remedy = f"name one that it was measured in, such as --mode {next(iter(screen.white_cd_m2))}"
        raise InputError(Finding(f"the display was not measured in the mode '{mode}'", remedy=remedy))
    if stereo and mode == "flat":
        message = f"{counted(len(stereo), 'picture is', 'pictures are')} stereo, such as '{stereo[0].name}', and the "
        message += "mode 'flat' shows both eyes the same"
        remedy = f"leave --mode out for {NO_SPECIAL_SCREEN}, or name the files of one eye only"
        raise InputError(Finding(message, remedy=remedy))
    return mode


def _checked(draft: Path, folder: Path) -> Experiment:
    """Return the study in ``draft`` after `cyclopean check`; what is wrong names its place in ``folder``."""
    report = check_file(draft / EXPERIMENT, CheckOptions(screen=False, pictures=False))
    if report.errors:
        errors = [(finding, (finding.file or "").replace(str(draft), str(folder))) for finding in report.errors]
        raise InputError([replace(finding, file=file or None) for finding, file in errors])
    return read_experiment(draft / EXPERIMENT)


def _refuse_present(folder: Path) -> None:
    if folder.is_dir() and not any(folder.iterdir()):
        return
    if folder.exists() or folder.is_symlink():
        remedy = "nothing is overwritten: name a folder that is not there yet"
        raise InputError(Finding("this is there already", str(folder), remedy=remedy))


def _line(text: str | None) -> str | None:
    return None if text is None else " ".join(text.split())


def _label(name: str) -> str:
    """Return a folder's name as an experiment may be called: lower case, digits, hyphens and underscores."""
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode().lower()
    return re.sub(r"[^a-z0-9_-]+", "_", plain).strip("_-")[:64] or "study"


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
