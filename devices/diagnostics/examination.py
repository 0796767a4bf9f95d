"""All checks on all sets of measurements, in the order of a report."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from devices.diagnostics.channels import additivity, channel_constancy, headroom, tone_response
from devices.diagnostics.colours import chromaticities, primary_colours, spectral_overlap
from devices.diagnostics.content import black_with_picture, dynamic_contrast, picture_level
from devices.diagnostics.diagnosis import Check, Diagnosis, DisplayCheck, JudgeOptions, Verdicts
from devices.diagnostics.drift import drift, repeatability
from devices.diagnostics.eyewear import crosstalk, glasses_transmittance, luminance_loss
from devices.diagnostics.gamut_and_model import estimated_codes, gamut, gamut_change, gamuts, model_difference
from devices.diagnostics.measured_sets import MeasuredSet, by_eye, read_sets
from devices.diagnostics.mixing import added_channels, standard_primaries, white_segment
from devices.diagnostics.panel import angular_colour, angular_luminance, pixel_independence, uniformity
from devices.diagnostics.readings import Kind, cable_colours, primaries, tagged, untagged
from devices.diagnostics.room_light import in_light_of, light_through, room_light, room_lights
from devices.diagnostics.signal_path import code_steps, frame_rate_control, last_codes, signal_range
from devices.diagnostics.warm_up import warm_up
from devices.display.display_file import EyeModels, read_display
from devices.display.model import DisplayModel
from devices.display.monitor_settings import MonitorSettings
from devices.display.nominal import NOT_MEASURED
from devices.errors import DeviceError
from devices.readings import Measurements, PatchEye
from devices.readings.spectra import for_observer
from devices.readings.table import CIE_1931_2
from documents import Finding
from documents.extensions import ExtensionError, Registry
from documents.options import made, taking

Examination = Callable[[Measurements], Diagnosis]
# Checks of readings of a special place, angle or surround.
SPECIAL: tuple[tuple[Examination, Kind], ...] = (
    (pixel_independence, "surround"),
    (uniformity, "place"),
    (angular_colour, "angle"),
    (angular_luminance, "angle"),
)
# Checks of the primaries and their mixtures, for which the colours of the set ``cable`` serve too.
OF_PRIMARIES = (primary_colours, spectral_overlap, gamut, additivity)
TIMELY: tuple[Examination, ...] = (repeatability, warm_up, drift)
CHECKS: tuple[Examination, ...] = (
    primary_colours,
    spectral_overlap,
    gamut,
    channel_constancy,
    additivity,
    tone_response,
    headroom,
    chromaticities,
    white_segment,
    added_channels,
    standard_primaries,
    signal_range,
    code_steps,
    last_codes,
    frame_rate_control,
    dynamic_contrast,
    black_with_picture,
    picture_level,
)

DIAGNOSTICS: Registry[DisplayCheck] = Registry(
    "cyclopean.diagnostics", {}, lambda _, kind: None if isinstance(kind, DisplayCheck) else "is no DisplayCheck"
)


@taking(JudgeOptions)
def judge_display(files: Sequence[Path], **options: Any) -> Verdicts:
    """Judge a display by its measurements.

    Parameters
    ----------
    files
        Files of measurements, as `devices.readings.read.read_measurements` reads them.
    **options
        Those of `JudgeOptions`: ``display``, ``mode``, ``without_glasses``, ``codes`` and ``white_cd_m2``.

    Returns
    -------
    Verdicts
        Each check passed, failed, or what would have to be read for it.

    Raises
    ------
    InputError
        With what is wrong with every file, if the mode is not known, or if it is for another observer than CIE 1931 2°
        and there are readings without spectra.

    Examples
    --------
    >>> import tempfile
    >>> from devices.readings import write_csv
    >>> table = Measurements([[0, 0, 0], [1, 1, 1]], [[0.1, 0.1, 0.1], [95, 100, 108]], ("black", "white"))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_csv(table, Path(folder, "readings.csv"))
    ...     verdicts = judge_display([Path(folder, "readings.csv")])
    >>> verdicts.diagnoses[0].name
    'repeatability'
    """
    given = made(JudgeOptions, options)
    display, codes, white_cd_m2 = given.display, given.codes, given.white_cd_m2
    if given.mode is not None and display is None:
        raise DeviceError("a mode is one of a display file: name that too (--display)")
    sets = read_sets(files, codes, white_cd_m2=white_cd_m2)
    bare = read_sets([given.without_glasses], codes, white_cd_m2=white_cd_m2)[0] if given.without_glasses else None
    models, observer = _models(display, given.mode, sets) if display is not None else (None, CIE_1931_2)
    diagnoses = examine(sets, models=models, observer=observer, without_glasses=bare)
    every = [*sets, *([bare] if bare is not None else [])]
    notes = [f"{measured.label}: {words}" for measured in every for words in measured.measurements.assumptions]
    notes += _settings_notes(every, display)
    if display is not None and (nominal := read_display(display).nominal):
        notes.append(f"the display file is {NOT_MEASURED} in modes without an entry of their own: {nominal.words}")
    if observer != CIE_1931_2:
        notes.append(
            f"the display file is for {observer}: its codes and colours are compared with readings summed from spectra "
            f"for that observer; all other checks are for {CIE_1931_2}"
        )
    return Verdicts(", ".join(measured.label for measured in sets), diagnoses, tuple(notes))


def _settings_notes(sets: Sequence[MeasuredSet], display: Path | None) -> list[str]:
    """Say how the monitor was set for each set of readings, and where its file says otherwise."""
    notes = []
    known = read_display(display).monitor_settings if display is not None else {}
    for measured in sets:
        if not (settings := MonitorSettings.parse(measured.measurements.monitor_settings, measured.label)).stated:
            continue
        notes.append(f"{measured.label}: the monitor was set to {settings.words}")
        notes += [f"{measured.label}: {words}" for words in settings.doubts]
        before = known.get(measured.measurements.mode)
        if before is not None and (differences := settings.differences(before)):
            notes.append(f"{measured.label}: the display file was measured otherwise: {'; '.join(differences)}")
    return notes + [f"{mode}: measured with {held.words}" for mode, held in known.items() if not notes]


def _models(file: Path, mode: str | None, sets: Sequence[MeasuredSet]) -> tuple[EyeModels, str]:
    """Return the models to compare readings with, and their observer, whose XYZ all readings must give."""
    display = read_display(file)
    if mode is None:
        named = {measured.measurements.mode for measured in sets if measured.measurements.mode}
        if len(named) == 1:
            mode = named.pop()
        elif len(display.modes) == 1 or (display.nominal and not display.modes):
            mode = display.only_mode()
        else:
            what = "the file has several modes, and the readings do not name theirs"
            remedy = f"name one with --mode: {', '.join(sorted(display.modes))}"
            raise DeviceError(Finding(what, str(file), remedy=remedy))
    models, observer = display.light_models(mode), display.observer(mode)
    bare = ", ".join(measured.label for measured in sets if measured.measurements.spectra is None)
    if observer != CIE_1931_2 and bare:
        what = f"the mode '{mode}' is for the observer {observer}; without spectra, XYZ are for {CIE_1931_2}: {bare}"
        remedy = f"give readings with spectra, leave --display out, or name a mode that was fitted for {CIE_1931_2}"
        raise DeviceError(Finding(what, str(file), remedy=remedy))
    return models, observer


def examine(
    sets: Sequence[MeasuredSet],
    *,
    models: EyeModels | None = None,
    observer: str = CIE_1931_2,
    without_glasses: MeasuredSet | None = None,
) -> tuple[Diagnosis, ...]:
    """Return the diagnoses of ``sets``, each eye's readings judged apart.

    A check that some set allows is left out for those that do not; one that none allows comes once, not judged.

    Parameters
    ----------
    sets
        Characterisations and special readings (`devices.diagnostics.readings`), in any order.
    models
        What the readings are compared with; for readings through both lenses the left eye's model. Readings that were
        taken in the dark are compared without the models' room light, and readings in another light with that.
    observer
        The colorimetric observer of the models, to whose XYZ readings are turned by their spectra to be compared.
    without_glasses
        The same patches read without glasses, compared with every set with primaries, through each lens. Where it is
        None, each set's own readings named ``...@no-glasses`` are.

    Returns
    -------
    tuple of Diagnosis
        Each with its verdict, value, limit, figure and table.

    Examples
    --------
    >>> import numpy as np
    >>> from devices.display import read_display
    >>> model = read_display(Path("configs/displays/asus_vg248qe.yaml")).models("quad-buffered").left
    >>> codes = np.repeat(np.linspace(0, 1, 9)[:, None], 3, axis=1)
    >>> readings = Measurements(codes, model.xyz(codes))
    >>> diagnoses = examine([MeasuredSet("model", readings)])
    >>> [diagnosis.name for diagnosis in diagnoses if diagnosis.passed]
    ['tone_response', 'headroom']
    """
    subjects = [pair for measured in sets for pair in by_eye(measured)]
    several = len(subjects) > 1
    diagnoses: list[Diagnosis] = []

    def add(made: list[tuple[str, Diagnosis]]) -> None:
        judged = [pair for pair in made if _has_result(pair[1])] or made[:1]
        for label, diagnosis in judged:
            diagnoses.append(replace(diagnosis, subject=label if several and _has_result(diagnosis) else ""))

    for check in TIMELY:
        add([(own.label, check(own.measurements)) for own, _ in subjects])
    for check, kind in SPECIAL:
        special = [part for measured in sets for part in _of_kind(measured, kind)] or list(sets[:1])
        add([(own.label, check(own.measurements)) for own in special])

    def of_tables(check: Examination, of_primaries: bool) -> None:
        tables = [_with_primaries(own.measurements) if of_primaries else own.measurements for own, _ in subjects]
        add([(own.label, check(table)) for (own, _), table in zip(subjects, tables, strict=True)])

    added = {name: _place(name) for name in (*DIAGNOSTICS.every(), *DIAGNOSTICS)}
    for check in CHECKS:
        of_tables(check, check in OF_PRIMARIES)
        for name in [name for name, (after, _) in added.items() if after == diagnoses[-1].name]:
            of_tables(partial(_of_package, name), added.pop(name)[1])
    for name, (_, of_primaries) in added.items():
        of_tables(partial(_of_package, name), of_primaries)
    add([(measured.label, crosstalk(measured.measurements)) for measured in sets])
    add([(measured.label, room_light(measured.measurements)) for measured in sets])
    if models is not None:
        turned = [replace(each, measurements=for_observer(each.measurements, observer, each.label)) for each in sets]
        alike = [pair for measured in turned for pair in by_eye(measured)]
        chosen = [(own, *_in_their_light(own, eye, models, turned)) for own, eye in alike]
        for judge in (estimated_codes, model_difference):
            add([(own.label, _with_words(judge(own.measurements, model), words)) for own, model, words in chosen])
    full = [own for own, _ in subjects if primaries(own.measurements)[0] is not None]
    if len(full) > 1:
        first = full[0]
        add([("", gamuts([(own.label, own.measurements) for own in full]))])
        add([(o.label, gamut_change(o.measurements, first.measurements, o.label, first.label)) for o in full[1:]])
    bare = [(own, _without_glasses(own.measurements, without_glasses)) for own, _ in subjects]
    pairs = [(own, table) for own, table in bare if table is not None]
    if pairs:
        seen = [(own, table) for own, table in pairs if primaries(own.measurements)[0] is not None] or pairs
        changes = [(o.label, gamut_change(o.measurements, b, "with glasses", "without glasses")) for o, b in seen]
        name, title = "gamut_change_by_glasses", "Change of gamut by the glasses"
        add([(label, replace(change, name=name, title=title)) for label, change in changes])
        add([(own.label, glasses_transmittance(own.measurements, table)) for own, table in seen])
        add([(own.label, luminance_loss(own.measurements, table)) for own, table in seen])
    return tuple(diagnoses)


def _place(name: str) -> tuple[str, bool]:
    """Return after which check a package's stands, if it can be used, and whether it is of primaries."""
    with suppress(ExtensionError):
        return DIAGNOSTICS[name].after, DIAGNOSTICS[name].of_primaries
    return "", False


def _of_package(name: str, measurements: Measurements) -> Diagnosis:
    """Return what a package's check says; where it raises or cannot be used, that it could not be made, and why."""
    whose = ""
    try:
        whose = DIAGNOSTICS.whose(name)
        with DIAGNOSTICS.blamed(name):
            found = DIAGNOSTICS[name].judge(measurements)
            if not isinstance(found, Diagnosis) or found.name != name:
                raise TypeError(f"what it returns is no Diagnosis named {name}")
    except ExtensionError as error:
        return Check(name, name, None, "", whose).unjudged(f"{error.findings[0].message}.")
    return replace(found, source=f"{found.source}; {whose}") if whose else found


def _in_their_light(
    own: MeasuredSet, eye: PatchEye, models: EyeModels, sets: Sequence[MeasuredSet]
) -> tuple[DisplayModel, str]:
    """Return the model of ``eye`` in the light that its readings were taken in, and words on it.

    A set of ``sets`` in which the screen was read while it was off may be a file of its own, beside the readings.
    """
    read = light_through(room_lights(own.measurements), eye)
    every = [light_through(room_lights(each.measurements), eye) for each in sets]
    elsewhere = [light for light in every if light is not None]
    return in_light_of(own.measurements, models.right if eye == "right" else models.left, read, elsewhere)


def _with_words(diagnosis: Diagnosis, words: str) -> Diagnosis:
    return replace(diagnosis, words=diagnosis.words + words) if _has_result(diagnosis) else diagnosis


def _with_primaries(measurements: Measurements) -> Measurements:
    """Return the readings, or those of the set ``cable`` as plain ones where they alone hold the primaries."""
    if primaries(measurements)[0] is not None:
        return measurements
    of_cable = cable_colours(measurements)
    return measurements if primaries(of_cable)[0] is None else of_cable


def _without_glasses(measurements: Measurements, given: MeasuredSet | None) -> Measurements | None:
    """Return the readings without glasses to compare ``measurements`` with, None if there are none."""
    bare = untagged(measurements, "no-glasses") if given is None else given.measurements
    return bare if len(bare) else None


def _of_kind(measured: MeasuredSet, kind: Kind) -> list[MeasuredSet]:
    """Return the readings of ``kind``, those through each lens, and through none in particular, apart."""
    table = measured.measurements
    rows = [row for row, _ in tagged(table, kind)]
    eyes = dict.fromkeys(table.eye[row] for row in rows)
    return [
        MeasuredSet(
            measured.label if eye == "both" else f"{measured.label}, {eye} eye",
            table.select([row for row in rows if table.eye[row] == eye]),
        )
        for eye in eyes
    ]


def _has_result(diagnosis: Diagnosis) -> bool:
    return diagnosis.passed is not None or diagnosis.value is not None
