"""Every fenced snippet of README.md and docs/*.md runs or is validated.

The snippets of a page share one namespace and run in order, in a folder of their own with copies of the configs and
experiments of the checkout. What a page takes for granted (a table, sessions, pictures) is made by its function in
`PAGES`, or by a hidden code block in the page.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import sys
from collections.abc import Callable, Mapping
from functools import cache
from itertools import permutations
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import pytest
from sybil import Example, Sybil
from sybil.parsers.markdown import CodeBlockParser, PythonCodeBlockParser, SkipParser

if TYPE_CHECKING:
    from runner.protocol import FileKind

# Compiled files are kept, whatever the shell says: else each command that a test starts compiles the program again.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

ROOT = Path(__file__).parent
Prepare = Callable[[Path], dict[str, Any]]

# YAML: what a part of a file is put into, by the kind of the file.
_EXPERIMENT = {
    "schema_version": 1,
    "name": "small",
    "rig": "rig.yaml",
    "stimuli": "recipe.yaml",
    "question": "Which is closer?",
    "layout": {"arrangement": "vertical", "size_mm": [20, 10]},
    "blocks": [{"kind": "instructions", "text": "Look."}],
}
_RIG: dict[str, Any] = {"schema_version": 1, "display": "display.yaml", "mode": "side-by-side", "distance_mm": 700}
_OBSERVERS = {"schema_version": 1, "kind": "bradley_terry", "stimuli": {"a": {"score": 1}, "b": {"score": 2}}}
_MODE = {
    "black_XYZ_cd_m2": [0.02, 0.02, 0.03],
    "primaries_XYZ_cd_m2": {"red": [10.83, 5.62, 0.54], "green": [9.67, 18.65, 1.63], "blue": [5.68, 2.20, 29.18]},
    "curve": {"kind": "gamma", "red": {"gamma": 2.1}, "green": {"gamma": 2.2}, "blue": {"gamma": 2.3}},
    "source": "made up",
}
_DISPLAY = {
    "schema_version": 1,
    "panel": {"resolution_px": [1920, 1080], "pixel_pitch_mm": 0.25},
    "modes": {"quad-buffered": _MODE},
}
# The key that says which kind of file a part belongs to, and the file around it.
_WHOLE: Mapping[str, Callable[[Any], Any]] = {
    "blocks": lambda part: {**_EXPERIMENT, **part},
    "analysis": lambda part: {**_EXPERIMENT, **part},
    "methods": lambda part: {**_EXPERIMENT, **part},
    "style": lambda part: {**_EXPERIMENT, **part},
    "keys": lambda part: {**_EXPERIMENT, **part},
    "psychometric": lambda part: {**_OBSERVERS, **part},
    "mode_options": lambda part: {**_RIG, **part},
    "monitor": lambda part: {**_RIG, **part},
    "photodiode_verification": lambda part: {**_RIG, **part},
    "timing_marks": lambda part: {**_RIG, **part},
    "curve": lambda part: {**_DISPLAY, "modes": {"quad-buffered": {**_MODE, **part}}},
    "quad-buffered": lambda part: {**_DISPLAY, "modes": {name: {**_MODE, **mode} for name, mode in part.items()}},
    "panel": lambda part: {**_DISPLAY, **part},
}
_READABLE = ("display", "rig", "camera", "regions", "verification", "observers")
_NAMED = re.compile(r"^# (\S+\.(?:yaml|csv))\b")


def _write_named(example: Example, name: str) -> Path:
    """Write a snippet to the file that its first line names, else to ``name``, for the snippets after it."""
    named = _NAMED.match(example.parsed)
    file = Path(named[1] if named else name)
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(example.parsed, encoding="utf-8")
    return file


def _fill(data: Any) -> Any:
    """Return a recipe with each `{...}` as the shipped recipe of its kind has it."""
    from documents.yaml import read_yaml

    left_out = [key for key, value in data.items() if value == {"...": None}] if isinstance(data, dict) else []
    if not left_out:
        return data
    shipped = [read_yaml(file).data for file in sorted(Path("configs/stimuli").glob("*.yaml"))]
    like = next(recipe for recipe in shipped if recipe["kind"] == data["kind"])
    return {**data, **{key: like[key] for key in left_out if key in like}}


def _file_kind(data: Mapping[str, Any]) -> FileKind:
    """Return the kind of a whole file, by the key that `documents.yaml.load` recognises it by."""
    from documents.yaml import KIND_BY_KEY
    from runner.observers import KINDS

    kind = KIND_BY_KEY[next((key for key in KIND_BY_KEY if key in data), "kind")]
    if kind == "recipe":
        return "observers" if data.get("kind") in KINDS else "stimuli"
    return cast("FileKind", kind)


def evaluate_yaml(example: Example) -> None:
    """Validate a snippet as a file of its kind, or as a part of one."""
    from documents.yaml import read_yaml
    from runner.check import CheckOptions, check_file
    from runner.presenter import ModeOptions, find_mode
    from runner.protocol import file_model

    file = _write_named(example, "snippet.yaml")
    data = _fill(read_yaml(file).data)
    named = file.name != "snippet.yaml"
    if isinstance(data, list):
        data = {"blocks": data}
    if "schema_version" not in data:
        key = next((key for key in _WHOLE if key in data), None)
        assert key is not None, f"no file has a part with the keys {', '.join(data)}"
        data = _WHOLE[key](data)
    elif "panel" in data and "modes" not in data:
        data = _WHOLE["panel"](data)
    kind = _file_kind(data)
    file_model(kind).model_validate(data)
    if not (named or kind in _READABLE or str(data.get("kind")).startswith("sparkle")):
        return  # it names pictures, or a study, that are not there
    if not named:
        file = Path("configs/rigs") / file.name
        file.write_text(json.dumps(data), encoding="utf-8")
        if kind == "rig":
            find_mode(data["mode"], ModeOptions.parse(data.get("mode_options", {})))
            own = {key: data[key] for key in ("observer",) if key in data}
            display = {**_DISPLAY, "modes": {data["mode"]: {**_MODE, **own}}}
            (file.parent / _RIG["display"]).write_text(json.dumps(display), encoding="utf-8")
    report = check_file(file, CheckOptions(screen=False, pictures=False))
    assert not report.errors, [str(error) for error in report.errors]


def evaluate_csv(example: Example) -> None:
    """Read a snippet as a table of comparisons, or else as readings of a display."""
    from analysis.comparisons import read_table
    from devices.readings import read_measurements

    file = _write_named(example, "snippet.csv")
    if "winner" in example.parsed or "choice" in example.parsed:
        assert read_table(file).wins.sum()
    else:
        assert len(read_measurements(file).codes)


SYBIL = Sybil(
    parsers=[
        PythonCodeBlockParser(),
        CodeBlockParser("yaml", evaluate_yaml),
        CodeBlockParser("csv", evaluate_csv),
        SkipParser(),
    ],
    patterns=["README.md", "docs/*.md"],
    excludes=["docs/decisions/*"],
    fixtures=["page_folder"],
)
pytest_collect_file = SYBIL.pytest()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Take ``--fast`` and ``--share``."""
    parser.addoption("--fast", action="store_true", help="leave out the dear files of tests/slow_files.txt")
    parser.addoption(
        "--share", action="store_true", help="with -n: each worker collects and runs its share of the files"
    )


def pytest_configure(config: pytest.Config) -> None:
    """Leave out windows with ``--fast``."""
    if config.option.fast:
        config.option.markexpr = f"({config.option.markexpr or 'not window'}) and not window"


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Leave out files and folders of which no test would run, before they are imported."""
    from tests.choice import left_out

    out = left_out(collection_path, config.option.markexpr, config.option.fast) or not _mine(collection_path, config)
    return True if out else None


def _mine(path: Path, config: pytest.Config) -> bool:
    """Whether this process collects a file or folder: with ``--share`` a worker has its own."""
    from tests.choice import share

    worker = getattr(config, "workerinput", None)
    if worker is None or not config.option.share:
        return True
    number, workers = int(worker["workerid"][2:]), worker["workercount"]
    return path in share(number % workers, workers, config.option.markexpr, config.option.fast)


def pytest_collection_modifyitems(items: list[pytest.Item], config: pytest.Config) -> None:
    """Give the snippets of a page the marker of its file; leave out those of README where another worker has them."""
    from tests.choice import file_marks

    items[:] = [item for item in items if _mine(item.path, config)]
    for item in items:
        if item.path.suffix == ".md":
            for mark in file_marks(item.path):
                item.add_marker(mark)


def _texture(width: int, height: int, seed: int = 0) -> Any:
    """Return a sparkling picture, XYZ of D50, float32 (height, width, 3), mean about 20 cd/m²."""
    import numpy as np
    from scipy.ndimage import gaussian_filter

    rng = np.random.default_rng(seed)
    light = 300 * (rng.random((height, width)) < 0.03) * rng.lognormal(0, 0.5, (height, width))
    luminance = 10 + gaussian_filter(light, 1.0)
    return (luminance[..., None] * np.array([0.964, 1.0, 0.825])).astype(np.float32)


def _noisy(picture: Any, seed: int = 1) -> Any:
    """Return a picture as another photograph has it, with noise of 1 %."""
    import numpy as np

    rng = np.random.default_rng(seed)
    return (picture * rng.normal(1, 0.01, (*picture.shape[:2], 1))).astype(np.float32)


_FEW = 4  # simulated observers
_STIMULI = ("2.1-stereo", "1.2-stereo", "2.1-flat", "1.2-flat")
_PAIRS = [
    {"kind": "screening", "tests": [{"test": "stereo_acuity", "pass_arcsec": 400, "levels_arcsec": [600, 400]}]},
    {"kind": "all_pairs", "repeats": 2, "catch": {"every": 6, "pairs": [["2.1-stereo", "1.2-flat"]]}},
    {"kind": "questionnaire", "questions": [{"name": "remarks", "kind": "text", "question": "Anything else?"}]},
]
_SERIES = {
    f"{paint}-{light}-{exposure_s}": {"paint": paint, "light": light, "exposure_s": exposure_s}
    for paint in ("GM1", "BC")
    for light in ("dim", "bright")
    for exposure_s in (1.3, 2, 4)
}
_SCALES = [{"name": name, "question": f"The {name}?"} for name in ("similarity", "difficulty")]
_CHOICES = [
    {"kind": "best_of_series", "series": {"by": ["paint", "light"], "order": "exposure_s"}, "ratings": _SCALES},
    {"kind": "rating", "ratings": [{"name": "quality", "question": "How good is it?", "highest": 5}]},
]


def _simulate(
    folder: Path, factors: Mapping[str, Mapping[str, Any]], views: list[str], blocks: list[Any], observers: int
) -> Path:
    """Show small pictures, by name, to simulated observers in ``views``; return the folder of their sessions."""
    import cyclopean

    folder.mkdir()
    for index, name in enumerate(factors):
        cyclopean.write_picture(folder / f"{name}.exr", _texture(80, 40, index), _texture(80, 40, index + 100))
    stimuli = [{"name": name, "file": f"{name}.exr", "flat_eye": "left", "factors": of} for name, of in factors.items()]
    shown = [f"{name}-{view}" for view in views for name in factors]
    panel = {"resolution_px": [640, 480], "pixel_pitch_mm": 0.25}
    files = {
        "recipe": {"schema_version": 1, "kind": "pictures", "views": views, "stimuli": stimuli},
        "display": {"schema_version": 1, "panel": panel, "modes": {"side-by-side": _MODE}},
        "rig": _RIG,
        "study": {**_EXPERIMENT, "blocks": blocks},
        "observers": {
            "schema_version": 1,
            "kind": "bradley_terry",
            "psychometric": {"stereo_acuity": {"threshold": 200}},
            "stimuli": {name: {"score": len(shown) - index} for index, name in enumerate(shown)},
        },
    }
    for name, data in files.items():
        (folder / f"{name}.yaml").write_text(json.dumps(data), encoding="utf-8")
    return cyclopean.simulate(folder / "study.yaml", folder / "observers.yaml", folder / "results", observers=observers)


@cache
def _results(pages_folder: Path, observers: int) -> Path:
    """Return a folder of paired comparisons by simulated observers, made once."""
    folder = pages_folder / f"small_study_{observers}"
    return _simulate(folder, {"2.1": {}, "1.2": {}}, ["stereo", "flat"], _PAIRS, observers)


def _with_results(name: str, observers: int = _FEW) -> Prepare:
    """Return what puts sessions into the folder ``name`` of ``results``."""

    def prepare(folder: Path) -> dict[str, Any]:
        shutil.copytree(_results(folder.parent, observers), folder / "results" / name)
        return {}

    return prepare


def _series(folder: Path) -> dict[str, Any]:
    shutil.copytree(
        _simulate(folder / "study", _SERIES, ["stereo"], _CHOICES, _FEW), folder / "results" / "exposure_series"
    )
    return {}


def _bids(folder: Path) -> dict[str, Any]:
    from extensions.bids import About, export_dataset

    export_dataset([_results(folder.parent, _FEW)], folder / "my_dataset", About("Small study", ("A. Author",)))
    return {}


def _table(folder: Path) -> dict[str, Any]:
    """Write table.csv: 12 observers compare four items, each pair in both orders, a tie in ten."""
    import random

    rng = random.Random(2016)
    score = {name: 4 - index for index, name in enumerate(_STIMULI)}
    lines = ["winner,loser,observer,first,outcome"]
    for observer in range(1, 13):
        for first, second in permutations(score, 2):
            won = rng.random() < score[first] / (score[first] + score[second])
            winner, loser = (first, second) if won else (second, first)
            lines.append(f"{winner},{loser},{observer:02d},{first},{'tie' if rng.random() < 0.1 else 'win'}")
    (folder / "table.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return {}


def _panel(folder: Path) -> dict[str, Any]:
    """Write panel.csv: what a display without fault would read."""
    import numpy as np

    from devices.display import read_display
    from devices.readings import Measurements, write_csv

    model = read_display(folder / "configs/displays/asus_vg248qe.yaml").models("quad-buffered").left
    levels = np.linspace(0, 255, 18).round()[:, None] / 255
    codes = np.concatenate([levels * channel for channel in ([1, 1, 1], [1, 0, 0], [0, 1, 0], [0, 0, 1])])
    write_csv(Measurements(codes, model.xyz(codes)), folder / "panel.csv")
    return {}


def _align(folder: Path) -> dict[str, Any]:
    from stimuli.align import homography_from_points, warp
    from stimuli.pictures import StereoImage, write_exr

    (folder / "developed").mkdir()
    plane = _texture(450, 340)
    left, right = plane[:, 10:], _noisy(plane[:, :440])
    for eye, view in (("left", left), ("right", right)):
        write_exr(folder / "developed" / f"{eye}.exr", StereoImage.flat(view))
    reference = [(0, 0), (439, 0), (439, 339), (0, 339)]
    moving = [(12, 9), (431, 11), (433, 333), (10, 331)]
    back = homography_from_points(moving, reference)
    return {"rendering": left, "photograph": warp(left, back, (440, 340)).picture}


def _colours(folder: Path) -> dict[str, Any]:
    photo = _texture(60, 40)
    return {"photo_XYZ": photo, "rendering_XYZ": _noisy(photo)}


def _plate(folder: Path) -> dict[str, Any]:
    import cyclopean

    cyclopean.write_picture(folder / "plate.exr", _texture(200, 100), _texture(200, 100, 1))
    return {}


def _regions(folder: Path) -> dict[str, Any]:
    import cyclopean

    photo = _texture(120, 80)
    cyclopean.write_picture(folder / "photo.exr", photo)
    cyclopean.write_picture(folder / "rendering.exr", _noisy(photo))
    regions = [{"kind": "grid", "name": "cells", "rows": 2, "columns": 2}]
    data = {"schema_version": 1, "regions": regions, "white_luminance_cd_m2": 120}
    (folder / "regions.yaml").write_text(json.dumps(data), encoding="utf-8")
    return {"saturated": photo[..., 1] > 1000}


def _each(*prepares: Prepare) -> Prepare:
    """Return what does each of ``prepares``."""
    return lambda folder: {name: value for prepare in prepares for name, value in prepare(folder).items()}


@pytest.hookimpl(optionalhook=True)  # pages are tested without pytest-xdist
def pytest_xdist_auto_num_workers(config: pytest.Config) -> int:
    """One more than the cores, since tests of windows wait, but eight at most, which take some 5 GB of memory."""
    from documents.platform import cores

    return min(cores() + (not config.option.fast), 8)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """With ``--share``, let each worker run all that it collected, and count progress in the tests of all of them."""
    if not config.option.share:
        return None
    from xdist.scheduler import EachScheduling

    made = EachScheduling(config, log)
    each: Any = config.pluginmanager.get_plugin("dsession")

    def schedule() -> None:
        EachScheduling.schedule(made)
        each._session.testscollected = sum(map(len, made.node2collection.values()))

    made.schedule = schedule
    return made


# What the snippets of a page take for granted, by the page's name.
PAGES: Mapping[str, Prepare] = {
    "README": _with_results("my_study"),
    "best_of_series": _series,
    "bids": _bids,
    "colour": _colours,
    "compare": _regions,
    "diagnose": _panel,
    "display": _plate,
    "factors": _table,
    "measures": _colours,
    "modes": _plate,
    "observer_table": _each(_with_results("dynamic_range", observers=7), _table),
    "pair_models": _table,
    "prepare": _each(_plate, _align),
    "python": _with_results("dynamic_range"),
    "report": _with_results("dynamic_range"),
    "scores": _table,
    "screening": _with_results("my_study"),
    "reviewers": _table,
    "uncertainty": _table,
}


@pytest.fixture(scope="session")
def pages_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder in which each page has one of its own, and the cache of stimuli."""
    return tmp_path_factory.mktemp("pages")


@pytest.fixture
def page_folder(request: pytest.FixtureRequest, pages_folder: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder in which a page's snippets run; made, with what they take for granted, at the first of them."""
    example: Example = request.node.example
    name = Path(example.path).stem
    folder = pages_folder / name
    new = not folder.exists()
    folder.mkdir(exist_ok=True)
    monkeypatch.chdir(folder)
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(pages_folder / "cache"))
    np.set_printoptions(legacy=False)  # colour-science, where another test imported it, asks for an old style
    if new:
        for shipped in ("configs", "experiments"):
            shutil.copytree(ROOT / shipped, folder / shipped)
        if prepare := PAGES.get(name):
            example.namespace.update(prepare(folder))
    return folder
