"""A bracket of photographs to one picture of linear light, in the camera's own RGB or in absolute XYZ."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from documents import Finding, InputError
from documents.files import unwritable
from documents.options import Typed
from documents.pages import Table
from documents.text import JsonResult, counted
from extensions.photo.bracket_options import BracketOptions
from extensions.photo.checks import check_alike, check_scene, exposure_notes, relative_exposures, where_moved
from extensions.photo.consistency import compare_neighbours, moved_blocks
from extensions.photo.merge import merge_exposures
from extensions.photo.noise import NoiseModel, estimate_noise
from extensions.photo.shots import Shot, by_photosite
from stimuli.develop import (
    Calibration,
    CameraImage,
    DevelopedPhotograph,
    SensorImage,
    calibration_of,
    make_picture,
    read_sensor_image,
    write_developed,
)
from stimuli.errors import StimulusError

Progress = Callable[[str, int, int], None]
_COLOURS = ("red", "green", "blue")
# A value that is not two standard errors above black is called dark.
_DARK = 2.0
_ERRORS_AT = 2_000_000


@dataclass(frozen=True, slots=True)
class BracketReport(JsonResult):
    """A merged bracket: what was written, the ``merge`` step with its counts, and ``notes``, a sentence each."""

    developed: DevelopedPhotograph
    merge: dict[str, Any]
    notes: tuple[str, ...]
    json_keys: ClassVar = {"developed": "*", "merge": None, "notes": "said"}

    def told(self) -> Iterator[str | Table]:
        """Yield a table of the exposures, the noise of each colour, the light, notes, and what was written."""
        headings = ("photograph", "time", "stated", "measured")
        yield Table.of_texts("Exposures beside the shortest", headings, map(_cells, self.merge["photographs"]))
        for colour in _COLOURS:
            noise, error = self.merge["noise"][colour], self.merge["relative_standard_error"][colour]
            if noise and noise["full_scale_electrons"] and error:
                yield (
                    f"Noise in {colour}: {noise['full_scale_electrons']:.0f} electrons at full scale, "
                    f"{noise['read_noise_electrons']:.2g} of read noise; standard error {100 * error['median']:.2g} % "
                    f"(median), {100 * error['p95']:.2g} % (95th percentile)"
                )
        if light := self.developed.luminance:
            yield f"Luminance: mean {light.mean_cd_m2:.4g}, max {light.max_cd_m2:.4g} cd/m²"
        yield from (f"Note: {note}." for note in self.notes)
        yield f"Written: {self.developed.output}, {self.developed.width_px}×{self.developed.height_px}"


def _cells(photograph: dict[str, Any]) -> tuple[str, ...]:
    time_s, error = photograph["exposure"]["time_s"], photograph["standard_error"]
    time = f"{time_s:.3g} s" if time_s >= 0.3 else f"1/{1 / time_s:.4g} s"
    measured = f"{photograph['measured_relative_exposure']:.4g}"
    told = "unchecked" if error is None else f"{measured} ± {error:.1g}" if error else measured
    return photograph["file"], time, f"{photograph['stated_relative_exposure']:.4g}", told


def bracket_photographs(
    photos: Annotated[Sequence[str | Path], Typed(metavar="PHOTO...")],
    output: Annotated[str | Path, Typed("-o --output", "OUT.exr", read="builtins.str")],
    options: BracketOptions | None = None,
    *,
    progress: Progress = lambda what, done, total: None,
) -> BracketReport:
    """Merge photographs of one scene at several exposures into one picture.

    PHOTO are raw files, or TIFF or OpenEXR files of linear camera RGB, from a camera that did not move, at one f-number
    and ISO. Each photosite is the mean of the exposures that are not full there, weighed by the sensor's noise. The
    exposures are compared with one another: other scenes, a changed light and moving objects are found.

    The result is as of `camera develop`: absolute XYZ with --camera, else camera RGB. The steps go into a .steps.json.

    Parameters
    ----------
    photos
        Two or more raw files, or TIFF or OpenEXR files of linear camera RGB, of one camera that did not move.
    output
        OpenEXR file to write.
    options
        The camera file, the demosaicing, dark frames and flat fields, and what is done where something moved.
    progress
        Called with what is being done, how many photographs are read, and how many there are.

    Returns
    -------
    BracketReport
        Size, effective exposure, saturated shares and every step.

    Raises
    ------
    InputError
        If a photograph cannot be read, they do not go together, show other scenes, or something moved between them;
        nothing is then written.

    Examples
    --------
    >>> import numpy as np
    >>> from tempfile import TemporaryDirectory
    >>> from devices.camera import Exposure
    >>> from stimuli.develop.linear_files import write_camera_exr
    >>> scene = np.random.default_rng(0).uniform(0.01, 0.9, (32, 48, 3)).astype(np.float32)
    >>> with TemporaryDirectory() as folder:
    ...     photos = [Path(folder, f"{number}.exr") for number in range(2)]
    ...     for number, photo in enumerate(photos):
    ...         rgb = np.minimum(scene * 4**number, 1)
    ...         write_camera_exr(photo, CameraImage(rgb, rgb >= 1, Exposure(4**number / 100, 8.0), photo.name))
    ...     report = bracket_photographs(photos, Path(folder, "merged.exr"))
    >>> report.merge["saturated_everywhere"]
    {'red': 0, 'green': 0, 'blue': 0}
    """
    options = options or BracketOptions()
    files, output = [Path(photo) for photo in photos], Path(output)
    _check_paths(files, output, options)
    calibration = calibration_of(options.develop)
    try:
        image, step, notes = merge_photographs(files, options, calibration, progress=progress)
    except OSError as error:
        elsewhere = "name another folder in the environment variable TMPDIR"
        place = Path(tempfile.gettempdir())
        raise StimulusError(unwritable(error, place, "temporary files", elsewhere=elsewhere)) from error
    developed = write_developed(image, f"{len(photos)} photographs", output, options.develop)
    return BracketReport(developed, step, notes)


def merge_photographs(
    photos: Sequence[Path],
    options: BracketOptions,
    calibration: Calibration,
    *,
    progress: Progress = lambda what, done, total: None,
) -> tuple[CameraImage, dict[str, Any], tuple[str, ...]]:
    """Return the merged picture, the step that says how, and notes in sentences; errors as `bracket_photographs`."""
    shots = _read(photos, options, calibration, progress)
    reference = _reference(shots, options)
    stated = [shot.exposure.relative_to(shots[0].exposure) for shot in shots]
    compared, samples = compare_neighbours(shots, stated)
    check_scene(shots, compared)
    measured = relative_exposures(shots, stated, compared)
    t = measured.relative if options.ratios == "measured" else stated
    level = min(shot.level for shot in shots)
    read = None if calibration.dark is None or len(calibration.dark) < 2 else calibration.dark.noise
    noise = [
        options.noise
        or estimate_noise(values, full, measured.relative, level, None if read is None else float(read[colour]))
        for colour, (values, full) in enumerate(zip(samples.values, samples.full, strict=True))
    ]
    blocks = moved_blocks(shots, measured.relative, noise)
    moved = where_moved(shots, measured.relative, blocks, compared, options.ghosts == "refuse", shots[reference].name)
    alone = np.logical_or.reduce(blocks) if moved else None
    merged, facts = _merge(shots, t, noise, level, alone, reference)
    if merged.saturated.all():
        what = "every photosite is full at every exposure"
        raise StimulusError.at(shots[0].sensor.source, what, "photograph the scene with shorter exposures too")
    step: dict[str, Any] = {
        "step": "merge",
        "photographs": [
            {
                "file": shot.name,
                "exposure": shot.exposure.to_json(),
                "stated_relative_exposure": stated[number],
                "measured_relative_exposure": measured.relative[number],
                "standard_error": measured.errors[number],
                "steps": [dict(step) for step in shot.sensor.steps],
            }
            for number, shot in enumerate(shots)
        ],
        "ratios": options.ratios,
        "reference": shots[reference].name,
        "noise": {
            "source": "given" if options.noise else "photographs" if read is None else "photographs and dark frames",
            **{name: None if model is None else model.to_json() for name, model in zip(_COLOURS, noise, strict=True)},
        },
        "moved": [place.to_json() for place in moved],
        **facts,
    }
    at = shots[reference].exposure
    merged = replace(
        merged,
        exposure=replace(at, time_s=at.time_s / t[reference]),
        exposure_source="merged",
        steps=({"step": "read", "kind": "bracket", "file": shots[reference].name}, step),
    )
    del shots
    if calibration.flat is not None:
        merged = Calibration(flat=calibration.flat).applied(merged)
    notes = (*exposure_notes(step["photographs"], measured, samples, level), *_notes(facts, noise, moved))
    return make_picture(merged, options.develop.demosaic), step, tuple(notes)


def _check_paths(photos: Sequence[Path], output: Path, options: BracketOptions) -> None:
    if len(photos) < 2:
        raise InputError(
            Finding(
                f"a bracket is of two photographs or more, and {counted(len(photos), 'is', 'are')} given",
                str(photos[0]) if photos else None,
                remedy="give all exposures of the scene; one photograph: cyclopean camera develop",
            )
        )
    if len({photo.resolve() for photo in photos}) < len(photos):
        raise InputError(Finding("a photograph is named twice", remedy="name it once"))
    if output.suffix.lower() != ".exr":
        raise InputError(Finding("the output is no .exr file", str(output), remedy="name one, such as merged.exr"))
    if any(output.resolve() == photo.resolve() for photo in photos):
        raise InputError(Finding("a photograph would be written over", str(output), remedy="name another output"))
    if options.exposures and len(options.exposures) != len(photos):
        what = f"{len(options.exposures)} exposures are given for {len(photos)} photographs"
        raise InputError(Finding(what, remedy="give one for each, in the order of the photographs, or none"))
    if options.reference is not None and options.reference.resolve() not in {photo.resolve() for photo in photos}:
        what = "the reference is none of the photographs"
        raise InputError(Finding(what, str(options.reference), remedy="name one of them"))


def _read(
    photos: Sequence[Path],
    options: BracketOptions,
    calibration: Calibration,
    progress: Progress,
) -> list[Shot]:
    """Return the photographs without their dark frames, the shortest exposure first."""
    develop = options.develop
    shots: list[Shot] = []
    dark = Calibration(calibration.dark)
    for number, photo in enumerate(photos):
        progress("Reading", number, len(photos))
        given = options.exposures[number] if options.exposures else None
        sensor = read_sensor_image(
            photo,
            levels=develop.levels,
            rotate=not develop.as_stored,
            exposure=given,
            assume_linear=develop.linear,
        )
        if sensor.exposure is None:
            raise StimulusError.at(
                photo,
                "the photograph's file has no exposure, and the bracket depends on it",
                "give --exposure TIME,F,ISO once for each photograph, in their order",
            )
        if shots:
            check_alike(sensor, shots[0])
        if calibration.flat is not None and number == 0:
            Calibration(flat=calibration.flat).applied(sensor)  # what does not go together is refused at once
        shots.append(Shot(dark.applied(sensor), sensor.exposure))
    progress("Reading", len(photos), len(photos))
    return sorted(shots, key=lambda shot: shot.exposure.light)


def _reference(shots: Sequence[Shot], options: BracketOptions) -> int:
    if options.reference is not None:
        chosen = options.reference.resolve()
        return next(number for number, shot in enumerate(shots) if shot.sensor.source.resolve() == chosen)
    camera = options.develop.camera
    if camera is not None and camera.exposure is not None:
        for number, shot in enumerate(shots):
            if shot.exposure.same_signal(camera.exposure):
                return number
    return len(shots) // 2


def _merge(
    shots: Sequence[Shot],
    t: Sequence[float],
    noise: Sequence[NoiseModel | None],
    level: float,
    alone: NDArray[np.bool_] | None,
    reference: int,
) -> tuple[SensorImage, dict[str, Any]]:
    """Return the merged values of the sensor, and what is to be said of them by colour."""
    first = shots[0]
    values = np.empty(first.shape, np.float32)
    saturated = np.empty(first.shape, bool)
    ghost = None if alone is None else by_photosite(alone, first.shape)
    full, dark = np.zeros(3, int), np.zeros(3, int)
    errors: list[list[NDArray[np.float64]]] = [[], [], []]
    every = max(1, first.shape[0] * first.shape[1] // _ERRORS_AT)
    for rows in first.bands():
        read = [shot.read(rows) for shot in shots]
        band = replace(first.sensor, values=values[rows], saturated=saturated[rows])
        for colour, places in enumerate(band.planes()):
            for place in places:
                merged = merge_exposures(
                    [part[place] for part, _ in read],
                    [mark[place] for _, mark in read],
                    t,
                    noise[colour],
                    full=level,
                    alone=None if ghost is None else ghost[rows][place],
                    reference=reference,
                )
                band.values[place], band.saturated[place] = merged.value, merged.saturated
                full[colour] += np.count_nonzero(merged.saturated)
                error = merged.standard_error
                dark[colour] += np.count_nonzero(merged.value < _DARK * np.nan_to_num(error))
                errors[colour].append((error / np.maximum(merged.value, 1e-12))[~merged.saturated].ravel()[::every])
    facts = {
        "saturated_everywhere": dict(zip(_COLOURS, full.tolist(), strict=True)),
        "dark_everywhere": dict(zip(_COLOURS, dark.tolist(), strict=True)),
        "relative_standard_error": {
            name: _quantiles(np.concatenate(parts)) for name, parts in zip(_COLOURS, errors, strict=True)
        },
        "range_stops": _range_stops(values),
    }
    return replace(first.sensor, values=values, saturated=saturated), facts


def _quantiles(errors: NDArray[np.float64]) -> dict[str, float] | None:
    known = errors[np.isfinite(errors)]
    if not len(known):
        return None
    median, p95 = np.quantile(known, [0.5, 0.95])
    return {"median": float(median), "p95": float(p95)}


def _range_stops(values: NDArray[np.float32]) -> float | None:
    """Return the logarithm to base 2 of the 99.9th percentile over the 0.1th, where that is above 0."""
    part = values.ravel()[:: max(1, values.size // _ERRORS_AT)]
    low, high = np.quantile(part, [0.001, 0.999])
    return float(np.log2(high / low)) if low > 0 else None


def _notes(facts: dict[str, Any], noise: Sequence[NoiseModel | None], moved: Sequence[Any]) -> list[str]:
    notes = []
    for key, words in (
        ("saturated_everywhere", "full at every exposure, and given as the shortest one has them: lower bounds"),
        ("dark_everywhere", "not two standard errors above black at any exposure"),
    ):
        counts = {name: count for name, count in facts[key].items() if count}
        if counts:
            of = ", ".join(f"{count} of {name}" for name, count in counts.items())
            notes.append(f"values {words}: {of}")
    if any(model is None for model in noise):
        notes.append(
            "too few values can be compared to find the sensor's noise: photon noise alone gives the weights, and "
            "there are no standard errors (give --noise)"
        )
    if moved:
        notes.append(f"{counted(len(moved), 'place', 'places')} where something moved: the reference exposure alone")
    return notes
