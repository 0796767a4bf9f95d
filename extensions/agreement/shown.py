"""The pictures as a display showed them, and how they were seen, by the record of the sessions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from analysis.errors import ResultsError
from analysis.records import Header, SessionLog
from devices.display import DisplayModel, pixels_per_degree
from documents import Finding
from runner.protocol import Experiment
from runner.reports import experiment_files, find_shown
from stimuli.build import StimulusSet, find_cached
from stimuli.errors import StimulusError
from stimuli.measures import MeasureRow, ViewingConditions, measure_pictures
from stimuli.pictures import StereoImage

_KEPT = 3


class ShownPictures:
    """The pictures of an experiment as its display showed them, and the ``viewing`` conditions of its sessions."""

    def __init__(self, experiment: Experiment, stimuli: StimulusSet, viewing: ViewingConditions) -> None:
        self.experiment, self.stimuli, self.viewing = experiment, stimuli, viewing
        self._image = lru_cache(maxsize=_KEPT)(self._displayed)

    def measured(self, photograph: str, stimulus: str, measures: Sequence[str]) -> dict[str, MeasureRow]:
        """Return what each measure, by name, says of a stimulus beside a photograph.

        What both eyes saw is measured, also of a flat stimulus beside a photograph in stereo.

        Raises
        ------
        StimulusError
            As `stimuli.measures.measure_pictures`, with the stimulus's name; or if the two were shown at different
            sizes.
        """
        one, other = self._image(photograph), self._image(stimulus)
        if one.left.shape != other.left.shape:
            sizes = [f"{image.width_px} x {image.height_px} px" for image in (other, one)]
            what = f"'{stimulus}' was shown with {sizes[0]} and '{photograph}' with {sizes[1]}"
            raise StimulusError.of(what, "measures compare pictures of one size: name a photograph of the same size")
        if one.is_flat != other.is_flat:
            one, other = _for_two(one), _for_two(other)
        try:
            return {row.measure.name: row for row in measure_pictures(one, other, measures, self.viewing).rows}
        except StimulusError as error:
            raise StimulusError(
                [replace(found, message=f"'{stimulus}': {found.message}") for found in error.findings]
            ) from error

    def mixed(self, photograph: str, stimuli: Sequence[str]) -> list[str]:
        """Return the stimuli that were flat beside a photograph in stereo, or in stereo beside a flat one."""
        flat = bool(self.stimuli.entry(photograph)["flat"])
        return [name for name in stimuli if bool(self.stimuli.entry(name)["flat"]) != flat]

    def _displayed(self, name: str) -> StereoImage:
        """Return what the display made of the part of a picture that the layout shows, clipped to its gamut."""
        image, models = self.stimuli.load(name, self.experiment.visible_part), self.experiment.rig.models
        left = _light(models.left, image.left)
        if image.is_flat and models.left is models.right:
            return StereoImage.flat(left)
        return StereoImage(left, _light(models.right, image.right))


def _light(model: DisplayModel, xyz_cd_m2: NDArray[np.float32]) -> NDArray[np.float32]:
    shown = model.xyz_of_linear(np.clip(model.linear(xyz_cd_m2), *model.limits))
    return np.maximum(shown, 0).astype(np.float32)


def _for_two(image: StereoImage) -> StereoImage:
    """Return a picture for two eyes: of a flat one, what each of them saw."""
    return StereoImage(image.left, image.left.copy()) if image.is_flat else image


def shown_pictures(sessions: Sequence[SessionLog], experiment: Path | None, results: Path) -> ShownPictures:
    """Return the pictures of the sessions from the cache, which must be those that were shown.

    Parameters
    ----------
    sessions
        Sessions of one experiment.
    experiment
        The experiment's file; None looks where reports look for it.
    results
        The folder of the results, near which it is looked for.

    Raises
    ------
    ResultsError
        If sessions were shown on displays or from distances that differ, the pictures are not in the cache or not those
        that were shown, or no experiment file with the sessions' display is found.
    """
    viewing = viewing_of(sessions)
    header = sessions[0].header
    files = [experiment] if experiment is not None else experiment_files(header, results)
    there = [file for file in files if file.is_file()]
    if not there:
        where = str(experiment) if experiment is not None else None
        what = "there is no such file" if where else f"no file of the experiment '{header.experiment}' is found"
        raise ResultsError(Finding(what, where, remedy="name the experiment file of these sessions: --experiment FILE"))
    for file in there:
        found = find_shown(header, file)
        if found is not None:
            return ShownPictures(*found, viewing)
    raise _not_those(header, there[0])


def _not_those(header: Header, file: Path) -> ResultsError:
    if find_cached(str(header.hashes.get("stimuli")), file) is None:
        what = "the pictures that these sessions showed are not in the cache, or changed since"
        remedy = f"build them as they were: cyclopean preview {file}; measures of other pictures would say nothing"
        return ResultsError(Finding(what, str(file), remedy=remedy))
    what = "the pictures are there, but this experiment file or its display is not that of the sessions"
    remedy = "name the experiment file of these sessions, with the display file as it was: --experiment FILE"
    return ResultsError(Finding(what, str(file), remedy=remedy))


def viewing_of(sessions: Sequence[SessionLog]) -> ViewingConditions:
    """Return how the pictures were seen, by the headers of the sessions.

    Raises
    ------
    ResultsError
        If a header does not say it, or two sessions differ in it.
    """
    first = sessions[0]
    seen = _seen(first)
    for session in sessions[1:]:
        for (what, value), (_, other) in zip(seen.items(), _seen(session).items(), strict=True):
            if not np.allclose(value, other, rtol=1e-6):
                words = f"the {what} of this session is {_words(other)}, that of {first.file} {_words(value)}"
                remedy = "the measures of their pictures differ: compare each station's sessions alone"
                raise ResultsError(Finding(words, str(session.file), 1, 1, remedy))
    pitch_mm, distance_mm = float(seen["pixel pitch in mm"][0]), float(seen["viewing distance in mm"][0])
    return ViewingConditions(
        pixels_per_degree=pixels_per_degree(pitch_mm, distance_mm),
        display_white_XYZ=seen["white in cd/m²"],
        pixel_pitch_mm=pitch_mm,
        distance_mm=distance_mm,
        observer=first.header.display.colorimetric_observer,
    )


def _seen(session: SessionLog) -> dict[str, NDArray[np.float64]]:
    display = session.header.display
    white, pitch_mm, distance_mm = display.white_XYZ_cd_m2, display.panel.pixel_pitch_mm, display.distance_mm
    if white is None or len(white.known) < 2 or pitch_mm is None or distance_mm is None:
        what = "the record does not say how the pictures were seen: display, distance and white"
        raise ResultsError(Finding(what, str(session.file), 1, 1, "restore the file"))
    brightest = max(white.known, key=lambda xyz: xyz[1])
    if min(brightest) <= 0:
        what = "the record has no white in cd/m² above 0"
        raise ResultsError(Finding(what, str(session.file), 1, 1, "restore the file"))
    return {
        "pixel pitch in mm": np.array([pitch_mm]),
        "viewing distance in mm": np.array([distance_mm]),
        "white in cd/m²": np.array(brightest),
    }


def _words(value: NDArray[np.float64]) -> str:
    return " ".join(f"{number:g}" for number in value)
