"""From a comparison to an experiment that shows the two pictures to observers."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from devices.colour_matching import DEFAULT_OBSERVER
from documents import Finding, InputError
from documents.files import no_file_name, whole_folder
from documents.text import visible
from stimuli.comparison import Comparison
from stimuli.pictures import Rows, StereoImage, write_exr

PICTURES = ("photograph", "rendering")
_NAME = re.compile(r"[a-z0-9][a-z0-9_-]{0,59}")
_GAP_MM = 10.0
# The band of the question above the pictures (`runner.views.layout`), in units of Style; the share of room used.
_QUESTION_UNITS, _SHARE = 80.0, 0.98


def checked_name(name: str, root: Path) -> None:
    """Refuse a name that no experiment can have, or one that is taken in ``root``. Raises InputError."""
    remedy = "1 to 60 small letters, digits, hyphens and underscores, first a letter or digit"
    if why := no_file_name(name):
        remedy = why
    elif _NAME.fullmatch(name):
        remedy = ""
    if remedy:
        raise InputError(Finding(f"an experiment cannot be called '{visible(name)}'", remedy=remedy))
    # A link that leads nowhere is there too: through it, something would be written elsewhere.
    taken = [place for place in _places(name, root).values() if os.path.lexists(place)]
    if taken:
        raise InputError(
            [Finding("it is there already", str(place), remedy="name another experiment") for place in taken]
        )


def _places(name: str, root: Path) -> Mapping[str, Path]:
    stimuli = root / "configs" / "stimuli"
    return {
        "experiment": root / "experiments" / f"{name}.yaml",
        "recipe": stimuli / f"{name}.yaml",
        "pictures": stimuli / name,
    }


def write_experiment(comparison: Comparison, name: str, rig_file: Path, root: Path) -> tuple[Path, ...]:
    """Write experiment, recipe and both pictures below ``root``, all or nothing, and return their places.

    The rendering is as it was compared: on the photograph's pixels, and times the luminance factor if one was undone.
    A pair for two eyes is shown in stereo and flat, by its left eye.

    Raises
    ------
    InputError
        If the name cannot be, or is taken, or a picture holds what a half float cannot.
    OSError
        If a file cannot be written.
    """
    checked_name(name, root)
    places = _places(name, root)
    for place in places.values():
        place.parent.mkdir(parents=True, exist_ok=True)
    made: list[Path] = []
    try:
        with whole_folder(places["pictures"]) as draft:
            for picture in PICTURES:
                write_exr(draft / f"{picture}.exr", _image(comparison, picture), comparison.photo.observer)
            texts = {"recipe": _recipe(comparison, name), "experiment": _experiment(comparison, name, rig_file, root)}
            for what, text in texts.items():
                with places[what].open("x", encoding="utf-8") as file:
                    made.append(places[what])
                    file.write(text)
    except BaseException:
        for file_made in made:
            file_made.unlink(missing_ok=True)
        raise
    return places["experiment"], places["recipe"], *(places["pictures"] / f"{picture}.exr" for picture in PICTURES)


def _image(comparison: Comparison, picture: str) -> StereoImage:
    def whole(rows: Rows) -> np.ndarray:
        return np.asarray(rows[0 : rows.shape[0]], dtype=np.float32)

    sides = [result.photo if picture == "photograph" else result.rendering for result in comparison.eyes.values()]
    if len(sides) == 1:
        return StereoImage.flat(whole(sides[0]))
    return StereoImage(whole(sides[0]), whole(sides[1]))


def _recipe(comparison: Comparison, name: str) -> str:
    stereo = len(comparison.eyes) == 2
    photo, rendering = comparison.photo.file.name, comparison.rendering.file.name
    lines = [
        f"# The two pictures that `cyclopean compare` compared: {visible(photo)} and",
        f"# {visible(rendering)}, in absolute XYZ on the photograph's pixels.",
        "schema_version: 1",
        "kind: pictures",
    ]
    if comparison.photo.observer != DEFAULT_OBSERVER:
        lines.append(f"observer: {comparison.photo.observer}")
    if stereo:
        lines.append("views: [stereo, flat]")
    lines.append("stimuli:")
    for picture in PICTURES:
        lines.append(f"  - {{name: {picture}, file: {name}/{picture}.exr{', flat_eye: left' if stereo else ''}}}")
    return "\n".join(lines) + "\n"


def _experiment(comparison: Comparison, name: str, rig_file: Path, root: Path) -> str:
    import yaml

    from devices.display import read_rig
    from runner.presenter.modes.options import ModeOptions
    from runner.presenter.modes.registry import find_mode
    from runner.presenter.surfaces.screens import primary_monitor

    rig = read_rig(rig_file, ask_monitor=primary_monitor)
    panel = rig.display.panel
    view_px = find_mode(rig.mode, ModeOptions.parse(rig.spec.mode_options)).areas(panel.resolution_px)[0].view_px
    arrangement, size_mm = _layout(comparison.photo.size_px, view_px, panel.pixel_pitch_mm)
    rig_path = Path(os.path.relpath(rig_file.resolve(), (root / "experiments").resolve())).as_posix()
    vertical = arrangement == "vertical"
    (first, first_place), (second, second_place) = (
        (("Up", "upper"), ("Down", "lower")) if vertical else (("Left", "left"), ("Right", "right"))
    )
    where = "one above the other" if vertical else "side by side"
    return "\n".join(
        [
            "# Written by `cyclopean compare`: do observers take the rendering for the photograph? Its objective",
            f"# verdict was: {comparison.verdict.decision}. Change what you like; the question is the study's own.",
            f"# Check this file with:  cyclopean check experiments/{name}.yaml",
            "schema_version: 1",
            f"name: {name}",
            f"rig: {yaml.safe_dump(rig_path, allow_unicode=True).splitlines()[0]}",
            f"stimuli: ../configs/stimuli/{name}.yaml",
            "question: Which image is closer to the real thing?",
            f"layout: {{arrangement: {arrangement}, size_mm: [{size_mm[0]:.1f}, {size_mm[1]:.1f}], "
            f"gap_mm: {_GAP_MM:g}, reference: physical}}",
            "blocks:",
            "  - kind: instructions",
            "    text: |",
            f"      Two images appear, {where}.",
            "      Compare each pair with the real thing beside the screen.",
            "",
            f"      {first} arrow: the {first_place} image is closer.",
            f"      {second} arrow: the {second_place} image is closer.",
            "  - {kind: all_pairs, stimuli: all, sides: counterbalanced, repeats: 10, break_every: 20}",
            "",
        ]
    )


def _layout(size_px: tuple[int, int], view_px: tuple[int, int], pitch_mm: float) -> tuple[str, tuple[float, float]]:
    """Return the arrangement of two pictures in an eye's view that shows most of them, and the size of each in mm."""
    from runner.views.style import Style

    words_mm = 2 * Style(view_px).px(_QUESTION_UNITS) * pitch_mm
    width_mm, height_mm = (side * pitch_mm for side in view_px)
    rooms = {
        "vertical": (width_mm, (height_mm - words_mm - _GAP_MM) / 2),
        "horizontal": ((width_mm - _GAP_MM) / 2, height_mm - words_mm),
    }
    shown = {
        # At most the picture, so that no black line surrounds it.
        name: (
            float(np.floor(10 * min(_SHARE * room[0], size_px[0] * pitch_mm)) / 10),
            float(np.floor(10 * min(_SHARE * room[1], size_px[1] * pitch_mm)) / 10),
        )
        for name, room in rooms.items()
    }
    best = max(shown, key=lambda name: shown[name][0] * shown[name][1])
    return best, shown[best]
