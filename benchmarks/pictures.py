"""Pictures on their way to a study: read, built, checked and shown, ordinary ones and large ones.

Pairs of JPEG of 2 megapixels to stimuli, beside decoding them, and sRGB to XYZ beside colour-science.

`stimuli build` reads, decodes, makes statistics of XYZ, and keeps the files as they are, hashed. Decoding is what
OpenImageIO and Pillow take for the same files, in one thread, in the same run. The error is the largest relative
difference from colour-science's decoding of sRGB in double precision. The command builds in two threads on two cores,
which is promised; processor time stands beside that of the clock, which other work changes more. A pair is then loaded,
from its own files and from codes as they are kept of other formats: the price of the smaller cache, paid in a thread
while another picture is shown.

Four stereo pairs of 36 megapixels built by the command, and one of them shown, each in a process of its own.

Seconds are those of the whole command, its start too; processor seconds and the most memory are beside them. The error
column has no meaning here: that bands of rows make the same files is in `stimuli_build.py`.

OpenEXR pictures of many channels: how many are read, in what time and memory, and reading all of them beside.

A new study from 200 pictures of 12 megapixels, beside what decoding them takes.

`runner.studies.new_study` reads headers and copies files. Times are those of JPEG files of about 4 MB, pairs and flat
pictures; decoding is Pillow's, timed on ten of them and multiplied. The error is the share of copies that are not byte
for byte the picture: 0.

A new study of 20 pairs of JPEG of 2 megapixels: checked, checked again, previewed, beside writing the PNG files.

`check` builds the stimuli and computes what the gamut costs; again, it finds both: the costs are counted, two, since
the 20 pairs show two scenes. `preview` draws each screen that differs once and writes it for each eye; beside it,
Pillow writes the same codes as PNG. The error of a preview is the largest difference of its codes from those that
Pillow's own copy gives back: 0; of `check`, whether two runs say the same. Files and bytes are counted.

The largest factor that saturates at most 0.3 % of a picture's pixels: run time against error.

The plain way halves an interval of factors and transforms the picture at each; ours transforms it once and takes an
order statistic. Error: relative to the order statistic of all pixels, sorted.
"""

from __future__ import annotations

import io
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from statistics import median
from time import perf_counter, process_time
from typing import Any, TypeVar

import colour
import numpy as np
import OpenImageIO as oiio
from curves import Row, is_quick, program, row, seconds, sized
from numpy.typing import NDArray
from PIL import Image
from promises import Promise, times_as_fast, worst

from devices.display import PanelSpec
from devices.display.display_file import read_display
from devices.display.model import DisplayModel
from documents import sha256_of_file
from runner.check import check_file
from runner.reports import preview
from runner.studies import StudyOptions, new_study
from stimuli.build import build_set
from stimuli.luminance.saturation import largest_factor
from stimuli.pictures import StereoImage, write_exr
from stimuli.pictures.coded import CodedPicture, decoded, read_coded
from stimuli.pictures.colour_spaces import named_encoding
from stimuli.pictures.exr_views import channel_runs

ORDINARY_PX = sized((1700, 1200), (170, 120))
ORDINARY_WHITE = 100.0


def photograph(seed: int) -> NDArray[np.uint8]:
    """Return a picture of shadings, edges and noise, about as large as a photograph once it is JPEG."""
    rng = np.random.default_rng(seed)
    width, height = ORDINARY_PX
    y, x = np.mgrid[:height, :width].astype(np.float32)
    shade = np.stack([np.sin(x / 170 + k) + np.cos(y / (130 + 20 * k)) for k in range(3)], axis=-1) * 50 + 120
    boxes = 30 * ((x // 90 + y // 70) % 2)[..., None]
    return np.clip(shade + boxes + rng.normal(0, 5, (height, width, 1)), 0, 255).astype(np.uint8)


def save_pairs(folder: Path, pairs: int) -> list[Path]:
    """Write so many pairs, of four pictures with bytes of their own at the end, so all differ; and their recipe."""
    kinds = []
    for seed in range(4):
        with io.BytesIO() as held:
            Image.fromarray(photograph(seed)).save(held, format="JPEG", quality=92)
            kinds.append(held.getvalue())
    files = []
    for pair in range(pairs):
        for eye in "LR":
            files.append(folder / f"p{pair}_{eye}.jpg")
            files[-1].write_bytes(kinds[len(files) % 4] + f"{pair}{eye}".encode())
    lines = [f"  - {{name: p{pair}, left: p{pair}_L.jpg, right: p{pair}_R.jpg}}" for pair in range(pairs)]
    head = f"schema_version: 1\nkind: pictures\ncolour_space: srgb\nwhite_luminance_cd_m2: {ORDINARY_WHITE}\nstimuli:\n"
    (folder / "recipe.yaml").write_text(head + "\n".join(lines) + "\n", encoding="utf-8")
    return files


def by_openimageio(file: Path) -> None:
    """Decode a file by OpenImageIO."""
    picture = oiio.ImageInput.open(str(file))
    assert picture is not None
    picture.read_image(0, 0, 0, 3, "uint8")
    picture.close()


def by_pillow(file: Path) -> None:
    """Decode a file by Pillow."""
    with Image.open(file) as picture:
        np.asarray(picture)


def both_clocks(work: Callable[[], object]) -> tuple[float, float]:
    """Return how many seconds ``work`` takes, by the clock and of the processor."""
    began, used = perf_counter(), process_time()
    work()
    return perf_counter() - began, process_time() - used


def ordinary(pairs: int = sized(100, 1)) -> dict[str, Any]:
    """Decode, build, and decode once more: what else the machine does changes meanwhile."""
    rows: list[dict[str, Any]] = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        files = save_pairs(folder, pairs)
        before = os.environ.get("CYCLOPEAN_CACHE")
        seconds: dict[str, list[tuple[float, float]]] = {"OpenImageIO decodes": [], "Pillow decodes": []}
        try:
            (folder / "first").mkdir()
            save_pairs(folder / "first", 1)
            os.environ["CYCLOPEAN_CACHE"] = f"{name}/first/cache"
            build_set(folder / "first" / "recipe.yaml", 0.25)  # no import is timed: `startup.py` does that
            for turn, jobs in enumerate((1, 2, 1)):
                seconds["OpenImageIO decodes"].append(both_clocks(lambda: [by_openimageio(file) for file in files]))
                seconds["Pillow decodes"].append(both_clocks(lambda: [by_pillow(file) for file in files]))
                os.environ["CYCLOPEAN_CACHE"] = f"{name}/cache{turn}"
                label = f"stimuli build, {jobs} thread{'s' if jobs > 1 else ''}"
                build = partial(build_set, folder / "recipe.yaml", 0.25, jobs=jobs)
                seconds.setdefault(label, []).append(both_clocks(build))
            built_set = build_set(folder / "recipe.yaml", 0.25)
            error = relative_error(built_set.load("p0").left, files[0])
            loads = loads_of_a_pair(read_coded(built_set.path("p0")), folder)
        finally:
            os.environ.pop("CYCLOPEAN_CACHE", None)
            if before is not None:
                os.environ["CYCLOPEAN_CACHE"] = before
    clock, processor = (min(times) for times in zip(*seconds["Pillow decodes"], strict=True))
    for series, times in seconds.items():
        built = series.startswith("stimuli build")
        least, used = (min(each) for each in zip(*times, strict=True))
        beside = f"{least / clock:.2f} times Pillow's decoding, {used / processor:.2f} times its processor time"
        rows.append(
            {
                "series": series,
                "parameter": f"{pairs} pairs of {ORDINARY_PX[0]} × {ORDINARY_PX[1]} px",
                "seconds": least,
                "error": error if built else 0.0,
                "note": beside if built else "",
                "ratio": least / clock,
                "processor ratio": used / processor,
            }
        )
    rows += loads
    rows += conversions()
    builds = [row for row in rows if str(row["series"]).startswith("stimuli build")]
    whole, processor = (min(float(row[key]) for row in builds) for key in ("ratio", "processor ratio"))
    promises = [
        Promise("a build with two threads beside Pillow's decoding", whole, 2.0, "ratio", unit="×"),
        Promise("processor time of a build beside that of Pillow's decoding", processor, None, "ratio", unit="×"),
        Promise("an sRGB picture in XYZ, relative error", worst(rows, series="stimuli build"), 1e-6, "error"),
    ]
    return {"title": "Ordinary pictures to stimuli", "rows": rows, "promises": promises}


def load_kept(file: Path) -> None:
    """Load what is kept in a file, to XYZ."""
    read_coded(file).image()


def loads_of_a_pair(picture: CodedPicture, folder: Path) -> list[Row]:
    """Return what loading a pair takes, kept as its own files and as codes, each in turn, and their bytes."""
    kept = {"a pair loaded from its own JPEG": picture, "a pair loaded from codes": replace(picture, own=None)}
    files = {series: folder / f"pair{each.suffix}" for series, each in kept.items()}
    for series, each in kept.items():
        each.save(files[series])
    shown = [read_coded(file).image() for file in files.values()]
    times: dict[str, list[float]] = {series: [] for series in kept}
    for _ in range(9):
        for series, file in files.items():
            times[series].append(timed(partial(load_kept, file))[0])
    return [
        row(
            series,
            f"{file.stat().st_size / 1e6:.1f} MB",
            median(times[series]),
            float(np.abs(image.left - shown[0].left).max()),
        )
        for (series, file), image in zip(files.items(), shown, strict=True)
    ]


def by_colour_science(codes: NDArray[Any]) -> NDArray[np.float64]:
    """Return XYZ of sRGB codes by colour-science, by the matrix of the rounded chromaticities."""
    light = colour.models.eotf_sRGB(codes / np.iinfo(codes.dtype).max)
    return np.asarray(light @ named_encoding("srgb").matrix.T * ORDINARY_WHITE)


def by_plain_twin(codes: NDArray[Any]) -> NDArray[np.float64]:
    """Return XYZ of sRGB codes as `Encoding.xyz` makes it."""
    shares = codes.reshape(-1, 3) / np.iinfo(codes.dtype).max
    return named_encoding("srgb").xyz(shares).reshape(codes.shape) * ORDINARY_WHITE


def relative_error(xyz: NDArray[Any], file: Path) -> float:
    """Return the largest relative difference from colour-science's XYZ of the codes that Pillow decodes."""
    with Image.open(file) as picture:
        reference = by_colour_science(np.asarray(picture))
    return float((np.abs(xyz - reference) / np.maximum(reference, 1e-9)).max())


def conversions() -> list[Row]:
    """Return time and error of XYZ from codes: the table, its plain twin, and colour-science."""
    encoding = named_encoding("srgb")
    rows: list[Row] = []
    for bits, kind in ((8, np.uint8), (16, np.uint16)):
        codes = np.random.default_rng(1).integers(0, 2**bits, (ORDINARY_PX[1], ORDINARY_PX[0], 3), dtype=kind)
        full = 2**bits - 1
        reference = by_colour_science(codes)
        works: dict[str, Callable[[], NDArray[Any]]] = {
            "table and matrix": partial(decoded, codes, encoding.tables(full + 1), encoding.matrix * ORDINARY_WHITE),
            "plain twin": partial(by_plain_twin, codes),
            "colour-science": partial(by_colour_science, codes),
        }
        for series, work in works.items():
            seconds = min(timed(work)[0] for _ in range(3))
            error = float((np.abs(work() - reference) / np.maximum(reference, 1e-9)).max())
            rows.append(row(series, f"2 megapixels of {bits} bits", seconds, error))
    return rows


ROOT = Path(__file__).parents[1]
LARGE_PX = sized((7360, 4912), (240, 160))
RIG = ROOT / "configs/rigs/asus_vg248qe_3dvision.yaml"
DISPLAY = ROOT / "configs/displays/asus_vg248qe.yaml"
NAMES = "abcd"
LIMIT_MB = 1200.0
# Runs the program on words; then its seconds, its processor's and the most memory, which Linux alone says.
COMMAND_MEASURED = """
import json, re, sys, time
from pathlib import Path
wall = time.perf_counter()
from runner.cli.main import main
try:
    main()
finally:
    status = Path("/proc/self/status")
    peak = re.search(r"VmHWM:\\s+([0-9]+) kB", status.read_text()) if status.exists() else None
    peak_mb = int(peak[1]) * 1024 / 1e6 if peak else None
    print(json.dumps([time.perf_counter() - wall, time.process_time(), peak_mb]), file=sys.stderr)
"""


def _write_pictures(folder: Path) -> None:
    """Write four pairs of grain that no compression shortens, and a recipe that scales their luminance."""
    width, height = LARGE_PX
    light = np.random.default_rng(0).uniform(1.0, 60.0, (height, width, 3)).astype(np.float32)
    for name, turned in zip(NAMES, (light, light[::-1], light[:, ::-1], light[::-1, ::-1]), strict=True):
        write_exr(folder / f"{name}.exr", StereoImage(turned, turned[:, ::-1]))
    recipe = {
        "schema_version": 1,
        "kind": "pictures",
        "luminance": {"scale": 0.9},
        "stimuli": [{"name": name, "file": f"{name}.exr"} for name in NAMES],
    }
    (folder / "recipe.yaml").write_text(json.dumps(recipe), encoding="utf-8")


def _command_measured(folder: Path, *words: object) -> tuple[float, float, float | None]:
    """Return a command's seconds, processor seconds and most memory in MB, if the system says it."""
    command = [sys.executable, "-c", COMMAND_MEASURED, *map(str, words)]
    own = {**os.environ, "PYTHONPATH": str(ROOT), "CYCLOPEAN_CACHE": str(folder / "cache")}
    done = subprocess.run(command, capture_output=True, text=True, encoding="utf-8", cwd=folder, env=own)
    if done.returncode:
        raise RuntimeError(f"cyclopean {' '.join(map(str, words))}: {done.stderr}")
    wall, cpu, peak_mb = json.loads(done.stderr.splitlines()[-1])
    return wall, cpu, peak_mb


def large() -> dict[str, Any]:
    """Build in two threads, and show."""
    rows: list[dict[str, Any]] = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        _write_pictures(folder)
        build = ("stimuli", "build", "recipe.yaml", "--rig", RIG)
        show = ("show", "a.exr", "--display", DISPLAY, "--mode", "side-by-side", "--headless", "--screenshot", "a.png")
        megapixels = f"2 × {LARGE_PX[0] * LARGE_PX[1] / 1e6:.1f} megapixels"
        for series, words in (("four pairs, scaled", (*build, "--jobs", 2)), ("a pair shown", show)):
            wall, cpu, peak_mb = _command_measured(folder, *words)
            row = {"series": series, "parameter": megapixels, "seconds": wall, "processor seconds": cpu}
            rows.append({**row, "peak MB": peak_mb, "error": None})
    built, shown = rows
    share = None if built["peak MB"] is None else built["peak MB"] / LIMIT_MB
    missing = "" if share is not None else "the system does not say how much memory a process took"
    promises = [
        Promise("four stereo pairs of 36 megapixels, scaled", built["seconds"], 25.0, "seconds", unit="s"),
        Promise("memory that they took, as against 1.2 GB", share, 1.0, "ratio", missing=missing),
        Promise("`show` of one of them", shown["seconds"], 6.0, "seconds", unit="s"),
    ]
    return {"title": "Pictures of 36 megapixels", "rows": rows, "promises": promises}


CHANNELS_PX = sized((1920, 1080), (96, 54))
CHANNELS = sized((3, 6, 12, 40), (6,))
READING_MEASURED = """
import json, re, sys, time
from pathlib import Path
import OpenImageIO as oiio
from stimuli.pictures import read_picture
peak = lambda: int(re.search(r"VmHWM:\\s+(\\d+) kB", Path("/proc/self/status").read_text())[1]) / 1e3
before, start = peak(), time.process_time()
if sys.argv[2] == "wanted":
    read_picture(sys.argv[1])
else:
    picture = oiio.ImageInput.open(sys.argv[1])
    picture.read_image(0, 0, 0, picture.spec().nchannels, "float")
print(json.dumps({"seconds": time.process_time() - start, "mb": peak() - before}))
"""


def layered_picture(path: Path, channels: int) -> Path:
    """Write a picture of R, G, B and layers beside them, of noise in half floats."""
    width, height = CHANNELS_PX
    spec = oiio.ImageSpec(width, height, channels, "half")
    spec.channelnames = ("R", "G", "B", *(f"layer{number:02d}.Z" for number in range(channels - 3)))
    spec.attribute("chromaticities", "float[8]", (0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329))
    spec.attribute("compression", "zip")
    output = oiio.ImageOutput.create(str(path))
    assert output is not None
    assert output.open(str(path), spec)
    pixels = np.random.default_rng(1).random((height, width, channels), dtype=np.float32)
    assert output.write_image(pixels)
    assert output.close()
    return path


def channels_read() -> dict[str, object]:
    """Return a row for each number of channels, read as wanted and all together, in a process each."""
    rows: list[dict[str, object]] = []
    with tempfile.TemporaryDirectory() as folder:
        for channels in CHANNELS:
            path = layered_picture(Path(folder, f"{channels}.exr"), channels)
            for series in ("wanted", "all"):
                command = [sys.executable, "-c", READING_MEASURED, str(path), series]
                facts = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
                read = sum(map(len, channel_runs([(0, 1, 2)]))) if series == "wanted" else channels
                rows.append(
                    row(
                        "cyclopean, R, G and B to XYZ" if series == "wanted" else "OpenImageIO, all channels",
                        f"{channels} channels in the file",
                        facts["seconds"],
                        0.0,
                        read=read,
                        note=f"{read} of {channels} channels read, {facts['mb']:.0f} MB",
                    )
                )
    most = worst(rows, "read", series="cyclopean")
    promises = [Promise("channels read where R, G and B are wanted", most, 3, "count", "exactly")]
    if not is_quick():
        taken = times_as_fast(
            [row for row in rows if row["parameter"] == f"{max(CHANNELS)} channels in the file"],
            "cyclopean, R, G and B to XYZ",
            "OpenImageIO, all channels",
        )
        promises.append(Promise("beside all of 40 channels", taken, 1.0, "ratio", "at least", "×"))
    return {
        "title": f"Reading OpenEXR of {CHANNELS_PX[0]} × {CHANNELS_PX[1]} pixels, in processor time",
        "rows": rows,
        "promises": promises,
    }


STUDY_FILES = sized(200, 4)
STUDY_PX = sized((4000, 3000), (400, 304))
STUDY_LIMIT_S = 10.0
DECODED = sized(10, 2)
STUDY_PANEL = PanelSpec(resolution_px=(1920, 1080), pixel_pitch_mm=0.2768)


def studies() -> dict[str, Any]:
    """Make both studies, and decode some of the pictures."""
    rows: list[Row] = []
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        original = folder / "original.jpg"
        _photograph().save(original, quality=90)
        digest = sha256_of_file(original)
        for series, stems in STUDY_NAMES.items():
            pictures = folder / series
            pictures.mkdir()
            for stem in stems:
                shutil.copyfile(original, pictures / f"{stem}.jpg")
            start = perf_counter()
            study = new_study(folder / f"{series} study", [pictures], StudyOptions(panel=STUDY_PANEL))
            seconds = perf_counter() - start
            copies = [sha256_of_file(file) for file in (study.folder / "pictures").iterdir()]
            wrong = sum(copy != digest for copy in copies) + abs(len(copies) - STUDY_FILES)
            megapixels, size_mb = STUDY_PX[0] * STUDY_PX[1] / 1e6, original.stat().st_size >> 20
            what = f"{STUDY_FILES} files of {megapixels:.0f} megapixels, {size_mb} MB"
            rows.append(row(series, what, seconds, wrong / STUDY_FILES))
            shutil.rmtree(study.folder)
            shutil.rmtree(pictures)
        start = perf_counter()
        for _ in range(DECODED):
            with Image.open(original) as picture:
                picture.load()
        decoding = (perf_counter() - start) * STUDY_FILES / DECODED
        rows.append(row("decoding alone (Pillow)", f"{STUDY_FILES} files", decoding))
    made = rows[: len(STUDY_NAMES)]
    promises = [
        Promise("share of copies that differ", worst(made), 0.0, "error", "exactly"),
        Promise("a study of 200 photographs", worst(made, "seconds"), STUDY_LIMIT_S, "seconds", unit="s"),
    ]
    return {"title": "A new study of photographs", "rows": rows, "promises": promises}


STUDY_NAMES = {
    "pairs": [f"photo{number}_{eye}" for number in range(STUDY_FILES // 2) for eye in "LR"],
    "flat": [f"photo{number}" for number in range(STUDY_FILES)],
}


def _photograph() -> Image.Image:
    """Return a picture with as much detail as a photograph has, for a file of a photograph's size."""
    width, height = STUDY_PX
    rng = np.random.default_rng(2016)
    coarse = rng.normal(128, 40, (height // 8, width // 8, 3))
    smooth = np.kron(coarse, np.ones((8, 8, 1)))
    return Image.fromarray(np.clip(smooth + rng.normal(0, 6, (height, width, 3)), 0, 255).astype(np.uint8))


PANEL = PanelSpec(resolution_px=sized((1920, 1080), (480, 270)), pixel_pitch_mm=0.2768)
FIRST = sized(10, 2)
COUNTED = ("clipping_costs_computed", "clipping_costs_cached", "pictures_rendered")
Made = TypeVar("Made")


def timed(work: Callable[[], Made]) -> tuple[float, Made]:
    """Return how many seconds ``work`` takes, and what it gives."""
    began = perf_counter()
    made = work()
    return perf_counter() - began, made


def written_again(files: tuple[Path, ...], folder: Path) -> tuple[float, int]:
    """Return in how many seconds Pillow writes the same pictures, and the largest difference of their codes."""
    folder.mkdir()
    codes = [np.asarray(Image.open(file)) for file in files]

    def save() -> None:
        for number, picture in enumerate(codes):
            Image.fromarray(picture).save(folder / f"{number}.png")

    seconds, _ = timed(save)
    again = [np.asarray(Image.open(folder / f"{number}.png")) for number in range(len(codes))]
    worst = max(int(np.abs(one.astype(int) - other).max()) for one, other in zip(codes, again, strict=True))
    return seconds, worst


def check_and_preview(pairs: int = sized(20, 2)) -> dict[str, Any]:
    """Check twice; preview whole, as a sheet, and its first trials."""
    rows: list[dict[str, Any]] = []
    before = os.environ.get("CYCLOPEAN_CACHE")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        os.environ["CYCLOPEAN_CACHE"] = f"{name}/cache"
        try:
            (folder / "photos").mkdir()
            save_pairs(folder / "photos", pairs)
            study = new_study(folder / "study", [folder / "photos"], StudyOptions(panel=PANEL)).folder
            experiment, what = study / "experiment.yaml", f"{pairs} pairs of 2 megapixels"
            seconds, first = timed(lambda: check_file(experiment))
            rows.append(row("check, pictures built", what, seconds))
            again, second = timed(lambda: check_file(experiment))
            said = [
                {key: report.facts[key] for key in report.facts if key not in COUNTED} for report in (first, second)
            ]
            same = said[0] == said[1] and not first.errors
            costs = ", ".join(f"{report.facts[COUNTED[0]]}" for report in (first, second))
            note = f"{seconds / again:.0f} times as fast as the first time; costs computed: {costs}"
            rows.append(row("check again", what, again, float(not same), note=note))
            shown: dict[str, dict[str, Any]] = {
                f"preview, first {FIRST} trials": {"first": FIRST},
                f"preview --sheet, first {FIRST} trials": {"first": FIRST, "sheet": True},
            }
            for series, options in shown.items():
                place = folder / series.replace(" ", "_")
                seconds, files = timed(partial(preview, experiment, place, **options))
                size = sum(file.stat().st_size for file in files) / 1e6
                note = f"{len(files)} files, {size:.1f} MB"
                line: dict[str, object] = row(series, what, seconds)
                if "sheet" not in options:
                    pillow, line["error"] = written_again(files, folder / f"{place.name}_again")
                    note += f"; {seconds / pillow:.2f} times Pillow's writing of them"
                    rows.append(row("Pillow writes the same", series, pillow))
                rows.append({**line, "note": note})
        finally:
            os.environ.pop("CYCLOPEAN_CACHE", None)
            if before is not None:
                os.environ["CYCLOPEAN_CACHE"] = before
    wrong = max(float(row["error"]) for row in rows if row["error"] is not None)
    promises = [
        Promise("difference of a preview's codes, and of a second check", wrong, 0, "count", "exactly"),
        Promise("clipping costs computed at the second check", second.facts[COUNTED[0]], 0, "count", "exactly"),
    ]
    return {"title": "A study checked and previewed", "rows": rows, "promises": promises}


LIMIT_PERCENT = 0.3
Picture = NDArray[np.float32]


def bisection(xyz: Picture, model: DisplayModel, steps: int) -> float:
    """Return the factor after so many halvings between 1e-3 and 1e3, in the logarithm at first."""
    low, high = 1e-3, 1e3
    pixels = xyz.size // 3
    for _ in range(steps):
        middle = np.sqrt(low * high) if high > 2 * low else 0.5 * (low + high)
        full = (model.linear(xyz * middle) > model.limits[1]).any(axis=-1).sum()
        low, high = (middle, high) if full <= LIMIT_PERCENT / 100 * pixels else (low, middle)
    return float(low)


def tone_factor() -> dict[str, object]:
    """Find the factor of made-up pictures of a display's and a camera's size."""
    model = read_display(DISPLAY).models("quad-buffered").left
    rows: list[Row] = []
    for name, shape in sized((("542 × 361", (361, 542)), ("2190 × 1460", (1460, 2190))), (("108 × 72", (72, 108)),)):
        random = np.random.default_rng(0)
        xyz = (random.lognormal(0, 1, (*shape, 1)) * random.uniform(0.8, 1.2, (*shape, 3))).astype(np.float32)
        pixels = shape[0] * shape[1]
        truth = bisection(xyz, model, 60)
        ours = largest_factor(xyz, model, LIMIT_PERCENT)
        time_s = seconds(partial(largest_factor, xyz, model, LIMIT_PERCENT), repeats=5)
        note = f"{ours.pixels_transformed:,} pixels transformed"
        error = abs(ours.factor / truth - 1)
        rows.append(row(f"ours, {name}", "exact", time_s, error, note=note))
        for steps in (12, 20, 30, 45):
            began = perf_counter()
            error = abs(bisection(xyz, model, steps) / truth - 1)
            slow = perf_counter() - began
            note = f"{steps * pixels:,} pixels transformed; ours is {slow / time_s:.1f} × as fast"
            line = row(f"bisection, {name}", f"{steps} steps", slow, error)
            rows.append({**line, "note": note})
    promises = [Promise("relative error of the factor", worst(rows, series="ours"), 1e-12, "error")]
    return {"promises": promises, "title": "Largest factor with at most 0.3 % of pixels saturated", "rows": rows}


if __name__ == "__main__":
    program("pictures", ordinary, large, channels_read, studies, check_and_preview, tone_factor)
