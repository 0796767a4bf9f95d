"""A display characterised from its readings: models, crosstalk, gain map and glasses, and the mode that they give.

Where the readings are of either eye, each eye is fitted by itself.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np

from devices.characterise.choose import characterise
from devices.characterise.fit_numbers import ModelNumbers
from devices.characterise.fitted_display import DisplayFit, EyeFit, origin_of
from devices.characterise.measured_parts import MeasuredParts, measured_parts
from devices.characterise.mode_file import ModeLines, write_mode
from devices.characterise.options import FileOptions, FitOptions
from devices.characterise.thesis import thesis_fits
from devices.characterise.told import black_words, curves_tables, notes
from devices.colour_matching import DEFAULT_OBSERVER
from devices.diagnostics.drift import estimate_drift
from devices.diagnostics.measured_sets import read_sets
from devices.diagnostics.readings import is_plain, part_of_picture, plain, tag
from devices.diagnostics.room_light import RoomLight, without_room
from devices.display import DisplayModel, GammaTable, PanelSpec
from devices.display.model_spec import ModelSpec
from devices.display.monitor_settings import MonitorSettings
from devices.errors import DeviceError
from devices.profiles import model_of_profile, read_profile
from devices.readings import PROFILE_ENDINGS, Measurements, PatchEye, carried
from devices.readings.spectra import for_observer
from documents import Finding, one_blas_thread
from documents.arrays import Floats
from documents.options import Typed, made, taking
from documents.pages import Block
from documents.text import JsonResult, counted

_USED_TAGS = frozenset({"other", "place", "no-glasses", "screen-off"})


@taking(FitOptions)
def fit_display(
    measurements: Measurements,
    *,
    without_glasses: Measurements | None = None,
    file: str | Path = "readings",
    **options: Any,
) -> DisplayFit:
    """Fit display models to measurements, and choose the one that predicts held-out readings best.

    Parameters
    ----------
    measurements
        Readings of patches; `devices.readings.read.read_measurements` reads them from a file.
    without_glasses
        Readings of the same patches without the glasses.
    file
        The file of the measurements, which the source in a display file names.
    **options
        Those of `FitOptions`: ``mode``, ``eye``, ``model``, ``observer``, ``seed``, ``keep_all`` and
        ``correct_drift``. With ``eye="both"``, readings that name either eye are fitted apart; for another
        ``observer`` than that of the readings they need spectra.

    Returns
    -------
    DisplayFit
        The candidates with their held-out errors in ΔE00, the chosen one, and what else the readings give.

    Raises
    ------
    DeviceError
        If the readings are for another observer and have no spectra, cannot be those of a display, or no model predicts
        them; see `devices.characterise.choose.characterise`.

    Examples
    --------
    >>> from devices.characterise import table_c1_codes, thesis_display
    >>> codes = table_c1_codes()
    >>> fit = fit_display(Measurements(codes, thesis_display().xyz(codes)), model="gog")
    >>> fit.eyes["both"].characterisation.chosen.held_out.mean < 0.01
    True
    """
    return _fit(measurements, made(FitOptions, options), without_glasses, file)


def fit_file(
    file: Annotated[str | Path, Typed(metavar="FILE", read="builtins.str")], options: FileOptions | None = None
) -> DisplayFit | ProfileMode:
    """Fit display models to measurements and choose the one that predicts best.

    FILE is a table of measurements: CSV, ArgyllCMS .ti3, a Psychtoolbox calibration .mat, the .jsonl of
    `display measure`, or an ICC profile. Every model is judged on readings that it was not fitted to. Where the file
    has readings of either eye, each is fitted by itself. Where patches that were read again show that the light drifted
    during the run, the readings are brought to its end. Readings beside the other eye's picture, at places of a grid
    and without glasses (@ in their names) give crosstalk, a gain map, and what the glasses take.

    Of an ICC profile without measurements inside, the table is asked for colours, which are fitted. Its matrix and
    curves are taken as they are, unless --model names another model.

    With -o the chosen model, crosstalk and gain map go into a mode of a display file. All else in the file stays, and
    what the mode has already is overwritten only with --replace. With --eye, the mode gets that eye alone.

    Parameters
    ----------
    file
        Measurements, as `devices.readings.read_measurements` reads them. Of an ICC profile without measurements inside
        the matrix and curves are taken as they are, unless a model, readings without glasses or an observer is named.
    options
        How the file is read and fitted, and what is written.

    Raises
    ------
    InputError
        If a file cannot be read or written, the readings are not those of a display, or a mode or panel is lacking.
    """
    options = options or FileOptions()
    fit, output = options.fit, options.output
    alone = fit.model == "auto" and options.without_glasses is None and fit.observer in (None, DEFAULT_OBSERVER)
    stated = read_profile_mode(file, options.white_cd_m2) if alone else None
    if stated is not None:
        _require_for_writing(options, fit.mode, options.panel)
        stated = replace(stated, mode=fit.mode, eye=fit.eye)
        if output and fit.mode:
            stated = stated.write(output, fit.mode, options.panel, eye=fit.eye, replace=options.replace)
        return stated
    files = [Path(path) for path in (file, options.without_glasses) if path]
    measured, *bare = read_sets(files, options.code_range, None, white_cd_m2=options.white_cd_m2)
    readings = plain(measured.measurements)
    _require_for_writing(options, fit.mode or readings.mode, options.panel or readings.panel)
    without_glasses = bare[0].measurements if bare else None
    fitted = replace(_fit(measured.measurements, fit, without_glasses, file), brief=options.brief)
    return fitted.write(output, options.panel, replace=options.replace) if output else fitted


def _require_for_writing(options: FileOptions, mode: str | None, panel: object) -> None:
    """Refuse at once, before anything is fitted, what would be missing for the display file."""
    missing: list[Finding] = []
    if options.output and not mode:
        missing.append(Finding("the measurements do not name a mode", remedy="give --mode with -o"))
    if options.output and not panel and not options.output.exists():
        what = f"there is no display file {options.output} yet"
        missing.append(Finding(what, remedy="a new one needs --panel 1920x1080,0.2768"))
    if missing:
        raise DeviceError(missing)


@one_blas_thread()
def _fit(
    measurements: Measurements, options: FitOptions, without_glasses: Measurements | None, file: str | Path
) -> DisplayFit:
    """Return what `fit_display` does, by ``options``."""
    model, eye = options.model, options.eye
    measurements = for_observer(measurements, options.observer or measurements.observer, str(file))
    if without_glasses is not None:
        without_glasses = for_observer(without_glasses, measurements.observer)
    settings = MonitorSettings.parse(measurements.monitor_settings, str(file))
    measurements, room = without_room(measurements)
    readings = plain(measurements)
    apart = {"left", "right"} <= set(readings.eye)
    chosen_eyes: tuple[PatchEye, ...] = ("left", "right") if eye == "both" and apart else (eye,)
    eyes: dict[PatchEye, EyeFit] = {}
    if model != "none":
        for each in chosen_eyes:
            own = readings if each == "both" else readings.for_eye(each)
            eyes[each] = _fit_eye(own, model, options)
    origin = origin_of(str(file), readings.instrument)
    parts = measured_parts(measurements, origin, without_glasses, chosen_eyes)
    notes = [*parts.notes, *_notes_on_tags(measurements), *_notes_on_part(readings), *settings.doubts]
    notes += [
        _on_the_room(lens, light, taken_off=len(readings) > 0, fitted=model != "none") for lens, light in room.items()
    ]
    if eyes and "both" in readings.eye:
        notes += _notes_on_leakage(parts)
    loaded = readings.gamma_table
    if loaded is not None and loaded.known and not loaded.is_identity:
        notes.append(f"the readings hold with the gamma table that was loaded, which is {loaded.sentence()}")
    through = set(readings.eye)
    lens = readings.eye[0] if chosen_eyes == ("both",) and len(through) == 1 and "both" not in through else None
    named = options.mode or readings.mode or None
    return DisplayFit(
        named,
        eyes,
        parts,
        tuple(notes),
        str(file),
        readings.instrument,
        readings.panel,
        lens,
        readings.assumptions,
        readings.observer,
        readings.gamma_table,
        settings,
        room,
    )


def _on_the_room(lens: PatchEye, light: RoomLight, *, taken_off: bool, fitted: bool) -> str:
    """Return what was found of the room's light, whether readings were changed by it, and what to write by hand."""
    words = light.words if lens == "both" else f"{lens} eye: {light.words}"
    if light.held and taken_off:
        words += (
            " It was taken off the readings, whose black is no darker; were they read in the dark, leave"
            " black@screen-off out of the file and write ambient_XYZ_cd_m2 by hand."
        )
    return words if fitted else f"{words} For the display file: {light.lines()[0]}"


def _fit_eye(readings: Measurements, model: str, options: FitOptions) -> EyeFit:
    drift = estimate_drift(readings) if options.correct_drift else None
    notes: tuple[str, ...] = ()
    if drift is not None and drift.seen:
        readings = drift.corrected(readings)
        notes = (f"{drift.words}; the readings were brought to the end of the run, --no-drift-correction keeps them",)
    else:
        drift = None
    characterisation = characterise(readings, model, seed=options.seed, keep_all=options.keep_all)
    notes += characterisation.notes
    patches = characterisation.patches
    try:
        return EyeFit(characterisation, thesis_fits(patches.codes, patches.XYZ), notes, drift)
    except DeviceError as error:
        return EyeFit(characterisation, None, (*notes, f"no tables by the thesis's methods: {error}"), drift)


def _notes_on_tags(measurements: Measurements) -> list[str]:
    """Return a note on the readings that nothing here uses: tagged ones, and those of a part of the picture."""
    tags = [tag(name) for name, kept in zip(measurements.name, is_plain(measurements), strict=True) if not kept]
    unused = sum(known is None or known.kind not in _USED_TAGS for known in tags)
    if not unused:
        return []
    readings = counted(unused, "reading", "readings")
    were = "was" if unused == 1 else "were"
    what = "at angles, on surrounds, while warming up or for other diagnoses (@ in the name, or a patch with an area)"
    return [f"{readings} {what} {were} left out"]


def _notes_on_part(readings: Measurements) -> list[str]:
    """Return a note on patches that filled a part of the picture, where all did."""
    part = part_of_picture(readings)
    if part is None:
        return []
    area, around = part
    codes = " ".join(f"{255 * code:.0f}" for code in around)
    where = f"all patches filled {100 * area:.3g} % of the picture, with codes {codes} (0-255) around them"
    return [f"{where}: where light depends on the picture (display report), the model holds for such pictures"]


def _notes_on_leakage(parts: MeasuredParts) -> list[str]:
    """Return a note that a model of readings with both eyes lit contains what leaked, where that is known."""
    leak = next(
        (
            diagnosis.value
            for diagnosis in parts.diagnoses
            if diagnosis.name == "crosstalk" and "crosstalk" in parts.lines
        ),
        None,
    )
    if not leak or leak <= 0:
        return []
    return [
        "if the other eye showed the patches too (display measure without --eye), each reading holds up to "
        f"{leak:.2g} % that leaked from it, and pictures whose crosstalk is cancelled come out so much too dark: "
        "measure with --eye left and --eye right"
    ]


@dataclass(frozen=True, slots=True, eq=False)
class ProfileMode(JsonResult):
    """A display model that an ICC profile states, ``notes`` in sentences, and the gamma table that it goes with.

    ``written`` is what was written of it into the ``mode`` of a display file, in sentences, for ``eye``.
    """

    file: str
    model: DisplayModel
    notes: tuple[str, ...]
    gamma_table: GammaTable | None = None
    mode: str | None = None
    eye: PatchEye = "both"
    written: str = ""
    json_keys: ClassVar = {"notes": "said", "kind": "model"}
    json_names: ClassVar = "notes kind white_XYZ_cd_m2 numbers"
    json_only: ClassVar = "facts"

    @property
    def facts(self) -> dict[str, Any]:
        """What a command prints as JSON."""
        facts = {"file": self.file, "mode": self.mode, self.eye: self}
        return facts | ({"written": self.written} if self.written else {})

    def told(self) -> Iterator[str | Block]:
        """Yield what people read of it, and what was written."""
        white = " ".join(f"{value:.4g}" for value in self.white_XYZ_cd_m2)
        yield f"The profile's matrix and curves, as they are ({self.kind}); its white: {white} cd/m²"
        yield from curves_tables(self.numbers)
        yield black_words(self.numbers, None)
        yield from notes(
            (*self.notes, "nothing in the profile says how well it describes the display: display verify does")
        )
        if self.written:
            yield self.written

    @property
    def kind(self) -> str:
        """The kind of its curves, as a display file names it."""
        return self.model.curves[0].kind_of_curve.replace("gogo", "gog")

    @property
    def numbers(self) -> ModelNumbers:
        """The model's numbers; a profile states no standard errors."""
        return ModelNumbers.of(self.model, {})

    @property
    def white_XYZ_cd_m2(self) -> Floats:
        """XYZ (3,) at full drive."""
        return self.model.xyz(np.ones(3))

    def write(
        self,
        file: str | Path,
        mode: str,
        panel: PanelSpec | None = None,
        *,
        eye: PatchEye = "both",
        replace: bool = False,
    ) -> ProfileMode:
        """Write the model into a display file; all else in the file stays as it is.

        Parameters
        ----------
        file
            The display file, made if it does not exist.
        mode
            The stereo mode.
        panel
            The panel of a new file.
        eye
            The eye that the model is of.
        replace
            Whether a characterisation that the mode has already is overwritten.

        Returns
        -------
        ProfileMode
            It, with what was ``written``.

        Raises
        ------
        DeviceError
            As `devices.characterise.mode_file.write_mode`.
        """
        source = f"matrix and curves of the ICC profile {Path(self.file).name}, as they are"
        spec = ModelSpec.of(self.model, source=source, gamma_table=self.gamma_table and self.gamma_table.to_json())
        written = write_mode(Path(file), mode, ModeLines({eye: spec.lines()}, {}), panel, replace=replace)
        return dataclasses.replace(self, written=written)


def read_profile_mode(path: str | Path, white_cd_m2: float | None = None) -> ProfileMode | None:
    """Return the matrix and curves of an ICC profile as a display model, if they are all that it says of its light.

    Parameters
    ----------
    path
        A file.
    white_cd_m2
        Luminance of the white in cd/m², above 0, in place of what the profile says of it.

    Returns
    -------
    ProfileMode or None
        None if the file is no profile, or one with measurements or a table inside, which are fitted.

    Raises
    ------
    DeviceError
        As `devices.profiles.read_profile` and `devices.profiles.model_of_profile`.
    """
    if Path(path).suffix.lower() not in PROFILE_ENDINGS:
        return None
    profile = read_profile(path)
    if profile.table_name or carried(profile) is not None:
        return None
    made = model_of_profile(profile, white_cd_m2)
    return ProfileMode(str(path), made.model, made.notes, profile.gamma_table)
