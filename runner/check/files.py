"""Check a file of any kind; its keys show which kind it is."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import isfinite
from pathlib import Path
from types import MappingProxyType
from typing import Any

from analysis.records import FILE_NAME
from devices.display import (
    EYES,
    Display,
    DisplayModel,
    FinestDetail,
    pixels_per_degree,
    read_display,
    read_rig,
    read_verification,
)
from documents import Finding, InputError
from documents.files import open_regular
from documents.tables import ENDINGS
from documents.text import did_you_mean, nearest
from documents.yaml import KIND_BY_KEY, read_yaml
from runner.check.display_facts import SETTINGS_REMEDY, check_display_facts, check_nominal
from runner.check.error_budget import rig_budget
from runner.check.experiment import (
    check_experiment,
    missing_pictures,
)
from runner.check.machine import check_rig_parts, check_screen
from runner.check.report import CheckOptions, CheckReport
from runner.presenter.modes.registry import MODES
from runner.presenter.surfaces.screens import primary_monitor
from stimuli.pictures import is_ordinary
from stimuli.recipes import read_recipe


def check_display(report: CheckReport, options: CheckOptions) -> None:
    """Check a display file."""
    display = read_display(report.file)
    white = {
        mode: {eye: round(float(m.eye(eye).shown_white_XYZ_cd_m2[1]), 2) for eye in EYES}
        for mode, m in display.modes.items()
    }
    modes = sorted(display.modes)
    if display.nominal:
        modes.append("any other, nominal" if modes else "any, nominal")
        white[modes[-1]] = dict.fromkeys(EYES, display.nominal.white_cd_m2)
    source = read_yaml(report.file)
    for mode in (*display.modes, *display.lacking):
        if mode not in MODES:
            what = f"there is no stereo mode '{mode}'"
            report.errors.append(source.finding(("modes", mode), what, did_you_mean(mode, MODES), key=True))
    report.facts.update({"kind": "display", "modes": modes, "white_luminance_cd_m2": white})
    report.facts.update(_contrasts(display))
    check_nominal(report, display.nominal)
    report.warnings.extend([display.unfinished(mode) for mode in display.lacking])
    if display.monitor_settings:
        report.facts["monitor_settings"] = {mode: held.words for mode, held in display.monitor_settings.items()}
    doubts = dict.fromkeys(words for held in display.monitor_settings.values() for words in held.doubts)
    report.warnings.extend([Finding(words, str(report.file), remedy=SETTINGS_REMEDY) for words in doubts])


def _contrasts(display: Display) -> dict[str, Any]:
    """Return white over black as each eye sees it: of the display, and in the room where its light was measured."""
    facts: dict[str, Any] = {}
    for name, in_the_room in (("contrast", False), ("contrast_in_the_room", True)):
        found = {
            mode: {eye: _contrast(models.eye(eye), in_the_room) for eye in EYES}
            for mode, models in display.modes.items()
            if not in_the_room or any(models.eye(eye).ambient_XYZ_cd_m2.any() for eye in EYES)
        }
        if found:
            facts[name] = found
    return facts


def _contrast(model: DisplayModel, in_the_room: bool) -> int | None:
    contrast = model.contrast(in_the_room=in_the_room)
    return round(contrast) if isfinite(contrast) else None


def check_rig(report: CheckReport, options: CheckOptions) -> None:
    """Check a rig file, and whether this machine's screen is that of the rig."""
    rig = read_rig(
        report.file,
        options.mode,
        allow_uncharacterised=options.allow_uncharacterised,
        ask_monitor=primary_monitor,
        monitors=options.monitors,
    )
    density = pixels_per_degree(rig.display.panel.pixel_pitch_mm, rig.spec.distance_mm)
    facts = {"kind": "rig", "mode": rig.mode, "observer": rig.observer, "pixels_per_degree": round(density, 2)}
    white_cd_m2 = max(float(rig.models.eye(eye).shown_white_XYZ_cd_m2[1]) for eye in EYES)
    report.facts.update(facts | {"finest_detail": list(FinestDetail.of(density, white_cd_m2).sentences())})
    check_display_facts(report, rig)
    if options.budget:
        report.facts["error_budget"] = rig_budget(rig).to_json()
    check_screen(report, rig, options)
    check_rig_parts(report, rig, options)


def check_verification(report: CheckReport, options: CheckOptions) -> None:
    """Check a record of onsets verified with a photodiode."""
    verification = read_verification(report.file)
    spec = verification.spec
    report.facts.update(
        {
            "kind": "verification",
            "mode": spec.mode,
            "refresh_hz": spec.refresh_hz,
            "onsets": verification.sentence(),
        }
    )


def check_camera(report: CheckReport, options: CheckOptions) -> None:
    """Check a camera file."""
    from devices.camera import read_camera

    camera = read_camera(report.file)
    exposure, zone = camera.exposure, camera.safe_luminance_cd_m2
    report.facts.update(
        {
            "kind": "camera",
            "form": camera.form,
            "observer": camera.observer,
            **({"exposure": str(exposure)} if exposure else {}),
            **({"safe_luminance_cd_m2": list(zone)} if zone else {}),
        }
    )
    if zone is None:
        what = "the camera's safe luminance zone is not known: light outside it would go unnoticed"
        remedy = "fit the camera to a chart: cyclopean camera fit"
        report.warnings.append(Finding(what, str(report.file), remedy=remedy))


def check_regions(report: CheckReport, options: CheckOptions) -> None:
    """Check a file of regions to compare; only the comparison finds out whether they lie inside the pictures."""
    from stimuli.comparison import read_regions

    regions = read_regions(report.file)
    report.facts.update(
        {
            "kind": "regions",
            "regions": [f"{region.name} ({region.kind})" for region in regions.spec.regions],
            "limit_delta_e_00": regions.limits.delta_e,
        }
    )


def check_recipe_or_observers(report: CheckReport, options: CheckOptions) -> None:
    """Check a recipe, or a file of simulated observers."""
    from runner.observers.observer_file import KINDS, ScoredObserverSpec, read_observer

    kind = str(read_yaml(report.file).data.get("kind"))
    if nearest(kind, KINDS):
        spec = read_observer(report.file)
        scored = {"stimuli": len(spec.stimuli)} if isinstance(spec, ScoredObserverSpec) else {}
        report.facts.update({"kind": "observers", **scored})
        return
    recipe, _ = read_recipe(report.file)
    report.errors.extend(missing_pictures(report.file))
    report.facts.update({"kind": "stimuli", "names": list(recipe.names())})


_CHECKS: Mapping[str, Callable[[CheckReport, CheckOptions], None]] = MappingProxyType(
    {
        "experiment": check_experiment,
        "display": check_display,
        "verification": check_verification,
        "camera": check_camera,
        "regions": check_regions,
        "rig": check_rig,
        "recipe": check_recipe_or_observers,
    }
)
BUDGETS = ("experiment", "rig")
_UNKNOWN = (
    "an experiment has 'blocks:', a display 'modes:', a rig 'mode:', a photodiode's record 'onset_error_ms:', a camera "
    "'matrix_XYZ_cd_m2:', areas to compare 'regions:', a recipe or observers 'kind:'"
)


# How files of other kinds begin, what they are, and what to do with them.
_PICTURE_REMEDY = "see it with cyclopean show {name}; make a study of pictures with cyclopean new my_study PICTURES..."
_BEGINNINGS: Mapping[bytes, tuple[str, str]] = MappingProxyType(
    {
        b"\x89PNG": ("a picture (PNG)", _PICTURE_REMEDY),
        b"\xff\xd8\xff": ("a picture (JPEG)", _PICTURE_REMEDY),
        b"II*\0": ("a picture (TIFF, or a camera's raw file)", _PICTURE_REMEDY),
        b"MM\0*": ("a picture (TIFF, or a camera's raw file)", _PICTURE_REMEDY),
        b"RIFF": ("a picture (WebP)", _PICTURE_REMEDY),
        b"GIF8": ("a picture (GIF)", _PICTURE_REMEDY),
        b"v/1\x01": ("a picture (OpenEXR)", _PICTURE_REMEDY),
        b"%PDF": ("a PDF page", "check reads the YAML files of a study"),
        b"PK\3\4": ("a zip file or a spreadsheet", "check reads the YAML files of a study"),
    }
)
_TABLE_REMEDY = "fit scores to a table of comparisons with cyclopean scores {name}; check reads YAML files"


def _other_file(path: Path) -> Finding | None:
    """Return what a folder, a picture or a table is, and which command takes it; None for what may be YAML."""
    if path.is_dir():
        if next(path.rglob(FILE_NAME), None):
            return Finding("this is a folder of results", str(path), remedy=f"report on them: cyclopean report {path}")
        found = sorted(file.name for file in path.glob("*.yaml"))
        if not found and any(is_ordinary(file) for file in path.rglob("*")):
            remedy = f"make a study of them: cyclopean new my_study {path}"
            return Finding("this is a folder of pictures", str(path), remedy=remedy)
        remedy = f"name a file in it, such as {path / found[0]}" if found else "check reads YAML files"
        return Finding("this is a folder", str(path), remedy=remedy)
    what, remedy = "", ""
    try:
        with open_regular(path) as stream:
            begins = stream.read(16)
    except (OSError, InputError):
        return None  # reading it as YAML says why
    if path.name == FILE_NAME:
        what, remedy = "the record of a session", "report on it: cyclopean report {name}"
    elif path.suffix.lower() in ENDINGS:
        what, remedy = "a table", _TABLE_REMEDY
    for beginning, kind in _BEGINNINGS.items():
        if begins.startswith(beginning):
            what, remedy = kind
    return Finding(f"this is {what}", str(path), remedy=remedy.format(name=path)) if what else None


def _a(kind: str) -> str:
    """Return ``kind`` with its article."""
    return "a file of regions" if kind == "regions" else f"a {kind}"


def check_file(path: Path, options: CheckOptions | None = None) -> CheckReport:
    """Read a file of any kind with everything it names, and report what it says and what is wrong.

    An experiment is checked with its rig, display, recipe, pictures, blocks, screen and results folder. Nothing is
    raised for what people wrote: all faults are among the report's errors.

    Parameters
    ----------
    path
        An experiment, display, rig, recipe, camera, simulated observers, regions, or a record of a photodiode.
    options
        What to look at beyond the file itself; the pictures of an experiment are built unless ``pictures`` is False.

    Returns
    -------
    CheckReport
        ``facts`` in the order in which they are printed, ``warnings``, and ``errors``, which keep a session from
        running. Each warning and error has file, line and column, where known, and a remedy.

    Examples
    --------
    >>> from pathlib import Path
    >>> report = check_file(Path("configs/displays/asus_vg248qe.yaml"))
    >>> report.facts["kind"], report.errors
    ('display', [])
    >>> report.facts["modes"]
    ['quad-buffered', 'side-by-side']
    """
    report = CheckReport(path)
    if other := _other_file(path):
        report.errors.append(other)
        return report
    try:
        data = read_yaml(path).data
        kind = (
            next((kind for key, kind in KIND_BY_KEY.items() if key in data), None) if isinstance(data, dict) else None
        )
        if kind is None:
            keys = [key for key in data if nearest(str(key), KIND_BY_KEY, cutoff=0.8)] if isinstance(data, dict) else []
            remedy = f"did you mean '{nearest(keys[0], KIND_BY_KEY)}:' for '{keys[0]}:'?" if keys else _UNKNOWN
            report.errors.append(Finding("this is not a kind of file that cyclopean reads", str(path), remedy=remedy))
        else:
            options = options or CheckOptions()
            if options.budget and kind not in BUDGETS:
                what, remedy = f"{_a(kind)} has no error budget", "name a rig or an experiment with --budget"
                report.errors.append(Finding(what, str(path), remedy=remedy))
            _CHECKS[kind](report, options)
    except InputError as error:
        report.errors.extend(error.findings)
    return report
