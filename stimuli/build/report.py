"""The report on a build: each stimulus with its notes, what a display cannot show, and a copy of the set."""

from __future__ import annotations

import contextlib
import errno
import json
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from operator import add
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from devices.colour import srgb, white_point
from devices.colour_matching import DEFAULT_OBSERVER
from devices.display import AskMonitor, Rig, read_rig
from documents import Finding, InputError, in_threads
from documents.files import read_cached_json, sha256_of_json, unwritable, whole_folder, write_whole, writing
from documents.options import Typed
from documents.pages import Table
from documents.platform import cores
from documents.text import JsonResult
from stimuli.build.cache import cache_folder
from stimuli.build.recipe_to_set import build_set
from stimuli.build.stimulus_set import MANIFEST, StimulusSet
from stimuli.pictures.coded import SUFFIXES as CODED
from stimuli.pictures.exr_write import write_exr
from stimuli.pictures.stereo_image import StereoImage, XYZImage
from stimuli.recipes.build_context import DisplaySetup, Factors

if TYPE_CHECKING:
    from PIL.Image import Image

# A built set as OpenEXR files and a recipe that shows them as they are: from here a careful user goes on.

RECIPE = "recipe.yaml"
# Set by the recipe itself.
_OWN_FACTORS = ("image", "view", "series")


def export_exr(built: StimulusSet, folder: Path, report: Callable[[int, int], None] = lambda done, total: None) -> None:
    """Write each stimulus of a built set to ``folder`` as OpenEXR in XYZ, both views, with a recipe of kind pictures.

    Codes of ordinary pictures become single precision; half floats stay what they are. The folder appears as a whole.

    Parameters
    ----------
    built
        The set, from `build_set`.
    folder
        A new or empty folder.
    report
        Called with how many pictures of how many are written.

    Raises
    ------
    InputError
        If it cannot be written.

    Examples
    --------
    >>> import numpy as np
    >>> from tempfile import TemporaryDirectory
    >>> from PIL import Image
    >>> from stimuli.build import build_set
    >>> recipe = "schema_version: 1\\nkind: pictures\\ncolour_space: srgb\\nwhite_luminance_cd_m2: 100\\n"
    >>> with TemporaryDirectory() as folder:
    ...     Image.fromarray(np.full((4, 6, 3), 99, np.uint8)).save(Path(folder, "grey.png"))
    ...     _ = Path(folder, "r.yaml").write_text(recipe + "stimuli: [{name: grey, file: grey.png}]")
    ...     export_exr(build_set(Path(folder, "r.yaml"), 0.25), Path(folder, "light"))
    ...     sorted(path.name for path in Path(folder, "light").iterdir())
    ['grey.exr', 'recipe.yaml']
    """
    observer = str(built.manifest["recipe"].get("observer", DEFAULT_OBSERVER))
    with writing(folder, "exported pictures"), whole_folder(folder) as draft:
        for done, name in enumerate(built.names):
            report(done, len(built.names))
            if built.path(name).suffix in CODED:
                write_exr(draft / f"{name}.exr", built.load(name), observer, exact=True)
            else:
                shutil.copyfile(built.path(name), draft / f"{name}.exr")
        (draft / RECIPE).write_text(_recipe(built, observer), encoding="utf-8")
        report(len(built.names), len(built.names))


def _recipe(built: StimulusSet, observer: str) -> str:
    lines = ["# XYZ in cd/m², as `cyclopean stimuli build` made them.", "schema_version: 1", "kind: pictures"]
    if observer != DEFAULT_OBSERVER:
        lines.append(f"observer: {observer}")
    lines.append("stimuli:")
    for name in built.names:
        factors = _factors(built.factors(name))
        more = f", factors: {json.dumps(factors, ensure_ascii=False)}" if factors else ""
        lines.append(f"  - {{name: {json.dumps(name)}, file: {json.dumps(name + '.exr')}{more}}}")
    return "\n".join(lines) + "\n"


def _factors(factors: Factors) -> dict[str, str | float]:
    return {key: value for key, value in factors.items() if key not in _OWN_FACTORS}


# Percentages by channel, and of pixels with any of them, for each eye.
Saturated = Mapping[str, Mapping[str, float]]
_COUNTED = (
    "but for the rounding of half floats"  # how pixels are counted: numbers that were counted otherwise are not kept
)
SHEET = "contact_sheet.png"
_NAMED = 3  # so many names are listed; of more, the first and how many others
_SIDE_PX, _GAP_PX, _LINE_PX = 192, 8, 16


@dataclass(frozen=True, slots=True)
class BuiltStimulus(JsonResult):
    """A stimulus of a built set; ``saturated_percent`` by eye and channel is None where no display is known."""

    name: str
    factors: Mapping[str, str | float]
    flat: bool
    size_px: tuple[int, int]
    statistics: Mapping[str, Any]
    notes: tuple[str, ...]
    saturated_percent: Saturated | None
    json_keys: ClassVar = {"notes": "said"}
    json_optional: ClassVar = ("saturated_percent",)


@dataclass(frozen=True, slots=True)
class BuildReport(JsonResult):
    """A built set and its stimuli; ``output`` is the folder that it was copied to, ``exported`` that of OpenEXR."""

    built: StimulusSet
    stimuli: tuple[BuiltStimulus, ...]
    output: Path | None
    exported: Path | None = None
    json_keys: ClassVar = {"built.recipe_path": "recipe", "built.manifest_path": "manifest"}
    json_names: ClassVar = (
        "built.recipe_path built.folder built.manifest_path built.digest built.rendered stimuli output exported"
    )
    json_optional: ClassVar = ("output", "exported")

    def told(self) -> Iterator[str | Table]:
        """Yield a table of the stimuli, notes on them, and where they lie."""
        has_rig = self.stimuli[0].saturated_percent is not None
        title = "Luminance in cd/m², left and right eye; range in stops from the darkest to the brightest thousandth"
        if has_rig:
            title += "; pixels beyond the display in %"
        columns = ["stimulus", "view", "size", "mean", "max", "range", "RMS contrast", *["saturated %"] * has_rig]
        rows = []
        for stimulus in self.stimuli:
            eyes = stimulus.statistics["eyes"]
            shown = ["left"] if stimulus.flat else ["left", "right"]
            stops = [eyes[eye]["dynamic_range_robust"]["stops"] for eye in shown]
            cells = [
                " ".join(f"{eyes[eye]['mean_luminance_cd_m2']:.3g}" for eye in shown),
                " ".join(f"{eyes[eye]['max_luminance_cd_m2']:.3g}" for eye in shown),
                " ".join("∞" if value is None else f"{value:.1f}" for value in stops),
                " ".join(f"{eyes[eye]['rms_contrast']:.2f}" for eye in shown),
            ]
            if stimulus.saturated_percent is not None:
                cells.append(" ".join(f"{stimulus.saturated_percent[eye]['any']:.2f}" for eye in ("left", "right")))
            size = "×".join(str(side) for side in stimulus.size_px)
            rows.append((stimulus.name, "flat" if stimulus.flat else "stereo", size, *cells))
        yield Table.of_texts(title, columns, rows, words=(0, 1))
        yield from (f"Note: {note}" for note in notes_on(self.stimuli))
        built, count = self.built, len(self.stimuli)
        stimuli = "1 stimulus" if count == 1 else f"{count} stimuli"
        yield f"{stimuli}, {built.rendered} of them made now; digest {built.digest[:16]}"
        yield f"Manifest: {built.manifest_path}"
        if self.output is not None:
            yield f"Copied to: {self.output}"
        if self.exported is not None:
            yield f"As OpenEXR, with a recipe that shows them: {self.exported}"


def notes_on(stimuli: Sequence[BuiltStimulus]) -> Iterator[str]:
    """Yield the notes on the stimuli: each sentence once, with those that it holds for."""
    names_by_note: dict[str, list[str]] = {}
    for stimulus in stimuli:
        for note in dict.fromkeys(stimulus.notes):
            names_by_note.setdefault(note, []).append(stimulus.name)
    for note, names in names_by_note.items():
        yield f"{_those(names, len(stimuli))}: {note}."


def _those(names: Sequence[str], of: int) -> str:
    if len(names) == of > 1:
        return "every picture"
    if len(names) <= _NAMED:
        return ", ".join(names)
    return f"{names[0]} and {len(names) - 1} others of the {of} pictures"


def build_report(
    recipe: Path,
    *,
    rig: Annotated[Path | None, Typed(metavar="RIG.yaml")] = None,
    pixel_pitch_mm: Annotated[float | None, Typed(metavar="MM")] = None,
    output: Annotated[Path | None, Typed("-o --output", "FOLDER")] = None,
    exported: Annotated[Path | None, Typed("--export-exr", "FOLDER")] = None,
    jobs: Annotated[int | None, Typed(metavar="N", least=1, most=256)] = None,
    force: bool = False,
    verify: bool = False,
    ask_monitor: AskMonitor | None = None,
    progress: Callable[[str, int, int], None] = lambda doing, done, total: None,
) -> BuildReport:
    """Build the pictures of a recipe, or take them from the cache.

    Pictures are made once and kept in the cache; after a change of the recipe, only the pictures that it concerns are
    made again.
    A build that was stopped is resumed. Wrong input is reported with its file and reason, and leaves the cache as it
    was.

    With a rig, the percentages of pixels that its display cannot show bright enough are reported too.

    Parameters
    ----------
    recipe
        The recipe: see `read_recipe`.
    rig
        Rig that will show the pictures: its pixels, range and distance.
    pixel_pitch_mm
        Pixel pitch of the display, if there is no rig.
    output
        New folder for a copy of pictures, manifest and contact sheet.
    exported
        New folder for the pictures as OpenEXR in XYZ, with a recipe.
    jobs
        Number of threads that make pictures. Default: 2.
    force
        Build all pictures again.
    verify
        Read every picture in the cache, not only those changed since.
    ask_monitor
        Called for what a monitor reports of itself, where the rig's display names none.
    progress
        Called with a description of the work, how much of it is done, and of how much.

    Returns
    -------
    BuildReport
        The built set, and of each stimulus its size, statistics, notes and, with a ``rig``, its saturated pixels.

    Raises
    ------
    InputError
        Unless either ``rig`` or ``pixel_pitch_mm`` is given; if the recipe or a picture is wrong, ``output`` is taken
        or lies in the cache, or a file cannot be written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from stimuli.pictures import StereoImage, write_exr
    >>> with TemporaryDirectory() as folder:
    ...     write_exr(Path(folder, "plate.exr"), StereoImage.flat(np.full((4, 6, 3), 5.0, np.float32)))
    ...     recipe = Path(folder, "recipe.yaml")
    ...     _ = recipe.write_text("{schema_version: 1, kind: pictures, stimuli: [{name: plate, file: plate.exr}]}")
    ...     report = build_report(recipe, pixel_pitch_mm=0.2768)
    >>> report.stimuli[0].name, report.stimuli[0].size_px
    ('plate', (6, 4))
    """
    shown_by, pitch_mm = display_of(rig, pixel_pitch_mm, ask_monitor)
    for folder in (output, exported):
        if folder is not None:
            _check_output(folder)
    setup = None if shown_by is None else DisplaySetup.of(shown_by)
    built = build_set(
        recipe,
        pitch_mm,
        lambda _, done, total: progress("Building stimuli", done, total),
        setup=setup,
        # Not more than two unless asked for: each thread may hold a pair of photographs, of 36 megapixels a few GB.
        jobs=jobs or min(2, cores()),
        force=force,
        verify=verify,
    )
    saturated = None
    if setup is not None:
        saturated = saturated_percent(built, setup, lambda done, total: progress("Looking at stimuli", done, total))
    if output is not None:
        copy_set(built, output, saturated, lambda done, total: progress("Copying", done, total))
    if exported is not None:
        export_exr(built, exported, lambda done, total: progress("Writing OpenEXR", done, total))
    stimuli = tuple(
        BuiltStimulus(
            entry["name"],
            entry["factors"],
            entry["flat"],
            built.size_px(entry["name"]),
            entry["statistics"],
            tuple(_notes(entry["steps"])),
            None if saturated is None else saturated[entry["name"]],
        )
        for entry in built.manifest["stimuli"]
    )
    return BuildReport(built, stimuli, output, exported)


def display_of(
    rig: Path | None, pixel_pitch_mm: float | None, ask_monitor: AskMonitor | None = None
) -> tuple[Rig | None, float]:
    """Return the rig, None where the pixel pitch stands for it, and the pixel pitch in mm. Raises InputError."""
    if rig is not None and pixel_pitch_mm is None:
        read = read_rig(rig, ask_monitor=ask_monitor)
        return read, read.display.panel.pixel_pitch_mm
    if rig is not None or pixel_pitch_mm is None:
        raise InputError(Finding("name the display", remedy="--rig RIG.yaml, or --pixel-pitch-mm MM"))
    return None, pixel_pitch_mm


def _notes(steps: list[Mapping[str, Any]]) -> list[str]:
    notes = [sentence for step in steps for sentence in step.get("said", ())]
    for step in steps:
        if step["step"] == "tone_map":
            asked, used = step["asked_luminance_scale"], step["luminance_scale"]
            note = f"tone mapped by {used:.3g}"
            if step["held_back"]:
                note += f" in place of {asked:.3g}: no more than {step['limit_percent']:g} % may saturate"
            notes.append(note)
    return notes


def _check_output(folder: Path) -> None:
    """Refuse a folder that holds anything, or lies in the cache, from which files are removed."""
    try:
        taken = folder.exists() and (not folder.is_dir() or any(folder.iterdir()))
        in_cache = folder.resolve().is_relative_to(cache_folder().resolve())
    except RuntimeError as error:
        raise InputError(unwritable(OSError(errno.ELOOP, str(error)), folder, "set")) from error
    except OSError as error:
        raise InputError(unwritable(error, folder, "set")) from error
    if in_cache:
        raise InputError(Finding("it lies in the cache of stimuli", str(folder), remedy="name a folder of your own"))
    if taken:
        raise InputError(Finding("there is something already", str(folder), remedy="name a new or an empty folder"))


def saturated_percent(
    built: StimulusSet, setup: DisplaySetup, report: Callable[[int, int], None] = lambda done, total: None
) -> dict[str, Saturated]:
    """Return for each stimulus and eye the percentage of pixels that ask the display for more than full light.

    Pictures are only read where the numbers for these very pictures and this display's range are not kept yet, large
    ones a band of rows at a time.
    """
    from stimuli.luminance.saturation import Saturation, measure_saturation

    models = setup.models

    def counted(read: Callable[[], StereoImage]) -> tuple[Saturation, Saturation]:
        image = read()
        left = measure_saturation(image.left, models.left, half=image.half)
        same = image.is_flat and models.left is models.right
        return left, left if same else measure_saturation(image.right, models.right, half=image.half)

    key = sha256_of_json([built.digest, setup.range_json(), _COUNTED])[:16]
    record = built.folder.with_name(f".{built.folder.name}-saturated-{key}.json")
    kept = read_cached_json(record)
    if isinstance(kept, dict) and kept.keys() == set(built.names):
        return kept
    percent: dict[str, Saturated] = {}
    for done, name in enumerate(built.names):
        report(done, len(built.names))
        lefts, rights = zip(*in_threads(counted, built.bands(name)), strict=True)
        percent[name] = {"left": reduce(add, lefts).to_json(), "right": reduce(add, rights).to_json()}
    report(len(built.names), len(built.names))
    # Where the cache cannot be written, the numbers are counted again next time.
    with contextlib.suppress(OSError):
        write_whole(record, json.dumps(percent))
    return percent


def copy_set(
    made: StimulusSet,
    folder: Path,
    saturated: Mapping[str, Saturated] | None = None,
    report: Callable[[int, int], None] = lambda done, total: None,
) -> None:
    """Copy pictures and manifest to ``folder``, which appears as a whole, with a contact sheet.

    The manifest lists what a display saturates, if ``saturated`` is given.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    with writing(folder, "set"), whole_folder(folder) as draft:
        for done, name in enumerate(made.names):
            report(done, len(made.names))
            shutil.copyfile(made.path(name), draft / made.path(name).name)
        (draft / MANIFEST).write_text(_manifest(made, saturated), encoding="utf-8")
        contact_sheet(made).save(draft / SHEET)
        report(len(made.names), len(made.names))


def _manifest(made: StimulusSet, saturated: Mapping[str, Saturated] | None) -> str:
    manifest = dict(made.manifest)
    if saturated is not None:
        manifest["stimuli"] = [
            {
                **entry,
                "statistics": {
                    **entry["statistics"],
                    "eyes": {
                        eye: {**values, "saturated_percent": saturated[entry["name"]][eye]}
                        for eye, values in entry["statistics"]["eyes"].items()
                    },
                },
            }
            for entry in manifest["stimuli"]
        ]
    return json.dumps(manifest, indent=1, allow_nan=False) + "\n"


def contact_sheet(made: StimulusSet) -> Image:
    """Return all stimuli small, a row of left and right where they differ, in sRGB.

    One white serves all, so that bright pictures are brighter: four times the largest mean luminance.
    """
    from PIL import Image, ImageDraw

    small = {name: [_small(eye) for eye in _eyes(made, name)] for name in made.names}
    white_cd_m2 = 4.0 * max(float(eye[..., 1].mean()) for eyes in small.values() for eye in eyes) or 1.0
    white_XYZ = white_point("d65", white_cd_m2, made.manifest["recipe"].get("observer", DEFAULT_OBSERVER))
    sizes = {name: (sum(eye.shape[1] + _GAP_PX for eye in eyes), eyes[0].shape[0]) for name, eyes in small.items()}
    cell = max(width for width, _ in sizes.values()), max(height for _, height in sizes.values()) + _LINE_PX + _GAP_PX
    columns = max(1, round((len(small) * cell[1] / cell[0]) ** 0.5))
    rows = -(-len(small) // columns)
    sheet = Image.new("RGB", (columns * cell[0] + _GAP_PX, rows * cell[1] + _GAP_PX), (32, 32, 32))
    draw = ImageDraw.Draw(sheet)
    for index, (name, eyes) in enumerate(small.items()):
        x, y = _GAP_PX + index % columns * cell[0], _GAP_PX + index // columns * cell[1]
        draw.text((x, y), name, fill=(220, 220, 220))
        for eye in eyes:
            codes = np.rint(255 * srgb(eye, white_XYZ)).astype(np.uint8)
            sheet.paste(Image.fromarray(codes), (x, y + _LINE_PX))
            x += eye.shape[1] + _GAP_PX
    return sheet


def _eyes(made: StimulusSet, name: str) -> list[XYZImage]:
    image = made.load(name)
    return [image.left] if image.is_flat else [image.left, image.right]


def _small(xyz: XYZImage) -> NDArray[np.float64]:
    """Return the picture averaged over blocks, 192 pixels at its longer side or less."""
    block = -(-max(xyz.shape[:2]) // _SIDE_PX)
    pad = [(0, -side % block) for side in xyz.shape[:2]]
    whole = np.pad(xyz.astype(np.float64), (*pad, (0, 0)), mode="edge")
    return np.asarray(whole.reshape(whole.shape[0] // block, block, -1, block, 3).mean(axis=(1, 3)))
