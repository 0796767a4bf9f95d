"""Every command that writes says in one line what it could not write, why in true words, and what to do.

The system refuses all writing below one folder: a full disk, one that may only be read, too many open files. Each
option that takes a text or a file is listed here, so that a command that begins to write is tried too.
"""

from __future__ import annotations

import builtins
import errno
import io
import os
import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click
import numpy as np
import pytest
from PIL import Image

from devices.readings import Measurements, write_csv
from documents import InputError
from runner.cli.main import group
from runner.presenter import open_surface
from runner.session import simulate
from tests.conftest import write_study
from tests.devices.diagnostics.simulated import MODEL, characterisation
from tests.devices.profiles.profile_bytes import matrix_tags, para, profile
from tests.runner.cli.every_command import EXTENDED, commands, offered
from tests.runner.measuring.displays import DISPLAY as SMALL
from tests.stimuli.comparison.scenes import PLATE, RIG, few, written
from tests.stimuli.develop.dng import exposure_tags, smooth, write_dng
from tests.stimuli.spectral.pictures import WAVES, bumps, save_exr

Cyclopean = Callable[..., subprocess.CompletedProcess[str]]  # tests/conftest.py
MEASURED = ("--instrument", "simulated", "--backend", "egl", "--settle", "0", "--eye", "left")
SIMULATED = ("--observer", "01", "--simulate", "IN/observers.yaml")

# Of each option, or argument, that names what a command writes: a call, where OUT is a folder that cannot be written.
WRITES: dict[tuple[str, str], str] = {
    ("new", "study"): "new OUT/study IN/photos",
    ("run", "--results"): f"run IN/small.yaml --results OUT/results {' '.join(SIMULATED)}",
    ("demo", "--results"): "demo --results OUT/results --observers 3",
    ("report", "--output"): "report IN/results -o OUT/report.html",
    ("report", "--csv"): "report IN/results -o page.html --csv OUT/csv",
    ("report", "--figures"): "report IN/results -o page.html --figures OUT/figures",
    ("export", "--output"): "export IN/results -o OUT/dataset --with-simulated",
    ("seal", "results"): "seal OUT",
    ("seal", "--new-key"): "seal --new-key OUT/key",
    ("scores", "--observer-scores"): "scores IN/table.csv --observers random --observer-scores OUT/scores.csv",
    ("power", "--output"): "power IN/small.yaml --observers 3 --replicates 3 -o OUT/power.html",
    ("power", "--csv"): "power IN/small.yaml --observers 3 --replicates 3 --csv OUT/power.csv",
    ("preview", "--output"): "preview IN/small.yaml -o OUT/preview --first 1",
    ("display new", "--output"): "display new -o OUT/display.yaml --panel 640x480,0.25",
    ("display patches", "--output"): "display patches IN/tiny/rig.yaml --set grey -o OUT/t.csv --each 0.001 --settle 0"
    " --backend egl",
    ("display measure", "--output"): f"display measure IN/tiny/rig.yaml -o OUT/m.jsonl --set grey {' '.join(MEASURED)}",
    ("display measure", "--table"): f"display measure IN/tiny/rig.yaml -o m.jsonl --table OUT/t.csv --set grey "
    f"{' '.join(MEASURED)}",
    (
        "display fit",
        "--output",
    ): "display fit IN/display.icc --white-cd-m2 80 --mode flat -o OUT/display.yaml --panel 1920x1080,0.2768",
    ("display verify", "--output"): f"display verify --display IN/tiny/rig.yaml -o OUT/v.jsonl {' '.join(MEASURED)}",
    ("display convert", "--output"): "display convert IN/display.yaml --mode side-by-side --to icc -o OUT/display.icc",
    ("display report", "--output"): "display report IN/readings.csv -o OUT/page.html",
    ("camera fit", "--output"): "camera fit IN/chart.csv -o OUT/camera.yaml",
    ("camera fit", "--report"): "camera fit IN/chart.csv --report OUT/page.html",
    ("camera develop", "--output"): "camera develop IN/photo.dng --demosaic superpixel -o OUT/a.exr",
    (
        "camera bracket",
        "--output",
    ): "camera bracket IN/raw/1_125.dng IN/raw/1_60.dng --demosaic superpixel -o OUT/a.exr",
    ("camera spectral", "--output"): "camera spectral IN/spectra.exr -o OUT/a.exr",
    ("compare", "--output"): f"compare IN/a.exr IN/b.exr --regions {PLATE} -o OUT/page.html",
    ("compare", "--experiment"): f"compare IN/a.exr IN/b.exr --regions {PLATE} --rig {RIG} --experiment study",
    (
        "agreement",
        "--output",
    ): "agreement IN/results --measures delta-e-2000 --photograph one --with-simulated -o OUT/page.html",
    (
        "agreement",
        "--csv",
    ): "agreement IN/results --measures delta-e-2000 --photograph one --with-simulated --csv OUT/csv",
    ("stimuli build", "--output"): "stimuli build IN/recipe.yaml --rig IN/rig.yaml -o OUT/set",
    ("stimuli build", "--export-exr"): "stimuli build IN/recipe.yaml --rig IN/rig.yaml --export-exr OUT/set",
    ("stimuli contrast", "--output"): "stimuli contrast IN/plate.yaml --pixel-pitch-mm 0.25 -o OUT/figure.pdf",
    (
        "show",
        "--screenshot",
    ): "show IN/one.exr --display IN/display.yaml --mode side-by-side --headless --screenshot OUT/a.png",
}
WRITES = {option: words for option, words in WRITES.items() if offered(option[0])}
# They write nothing but to the cache and the state folder, which the program can do without.
ONLY_READ = {
    *("check", "watch", "verify", "display metamerism", "camera geometry", "stimuli list", "stimuli clean", "doctor"),
    *("schema", "completion", "help"),
}
READ = {
    *("--again", "--ages", "--author", "--black", "--camera", "--choice-codes", "--codes", "--corners", "--dark"),
    *("--display", "--experiment", "--exposure", "--limit", "--observers", "--screened", "--flat", "--from"),
    *("--illuminant", "--instrument", "--instrument-option"),
    *("--jod-zero", "--key", "--layout", "--license", "--margin", "--measures", "--mirror", "--mode", "--mode-option"),
    *("--monitor", "--name", "--noise", "--notes", "--observer", "--observers-from", "--packing", "--pair", "--panel"),
    "--listen",
    *(
        "--part",
        "--passed",
        "--photo-corners",
        "--photograph",
        "--pixels",
        "--port",
        "--question",
        "--reference",
        "--regions",
    ),
    *("--rendering-corners", "--replay", "--rig", "--right", "--scheduler", "--scores", "--sensitivities"),
    *(
        "--sensor-mm",
        "--set",
        "--simulate",
        "--size-mm",
        "--start",
        "--stimuli",
        "--task",
        "--to",
        "--white",
        "--without",
    ),
    "--without-glasses",
}
REFUSALS = {
    errno.ENOSPC: ("is full", "make room"),
    errno.EROFS: ("may only be read", "another"),
    errno.EMFILE: ("as many files open as it may (EMFILE)", "ulimit -n"),
}


def test_every_option_that_names_what_is_written_is_tried() -> None:
    typed = {called: each for called, each in commands(group) if not isinstance(each, click.Group)}
    tried = {called for called, _ in WRITES}
    assert set(typed) == tried | set(filter(offered, ONLY_READ))
    assert not tried & ONLY_READ
    named = {
        (called, max(one.opts, key=len))
        for called, command in typed.items()
        for one in command.params
        if one.type.name in ("path", "text", "filename") or isinstance(one.type, click.Path | click.File)
    }
    assert set(WRITES) <= named
    others = [(called, one) for called, one in named - set(WRITES) if one.startswith("-") and one not in READ]
    assert others == [("check", "--results")], "a new option: is it written?"


@pytest.fixture(scope="module")
def materials(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """What the commands read; the pictures are in a cache."""
    folder = tmp_path_factory.mktemp("materials")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CYCLOPEAN_CACHE", str(folder / "cache"))
        study = write_study(folder)
        simulate(study.experiment, study.observers, 3, results=study.results)
        yield _with_others(folder)


def _with_others(folder: Path) -> Path:
    (folder / "photos").mkdir()
    for name in ("a", "b", "c"):
        Image.new("RGB", (40, 30), "gray").save(folder / "photos" / f"{name}.png")
    (folder / "tiny").mkdir()
    (folder / "tiny" / "display.yaml").write_text(SMALL)
    (folder / "tiny" / "rig.yaml").write_text(
        "schema_version: 1\ndisplay: display.yaml\nmode: row-interleaved\ndistance_mm: 700\n"
    )
    rows = [f"{a},{b},2,{who}" for who in range(5) for a in "xyz" for b in "xyz" if a != b]
    (folder / "table.csv").write_text("winner,loser,count,observer\n" + "\n".join(rows) + "\n")
    codes = np.asarray(characterisation().codes)
    write_csv(Measurements(codes, MODEL.xyz(codes), mode="flat"), folder / "readings.csv")
    (folder / "display.icc").write_bytes(profile(matrix_tags(para(2, 2.25, 0.999, 0.0, 0.002), lumi=None)))
    write_dng(folder / "photo.dng", smooth(), black=(600,), white=15520, tags=exposure_tags((1, 15), (8, 1), 200))
    if EXTENDED:
        from tests.extensions.photo.sensor import TIMES, bracket, scene
        from tests.extensions.photo.test_fit_command import _table

        _table(folder / "chart.csv")
        bracket(folder / "raw", scene(48, 64, stops=5) / 4, TIMES[1:4])
    save_exr(folder / "spectra.exr", bumps(WAVES))
    for name in ("a", "b"):
        written(folder / f"{name}.exr", few())
    plate = (Path(__file__).parents[3] / "configs/stimuli/manitoba_gray.yaml").read_text(encoding="utf-8")
    (folder / "plate.yaml").write_text(plate.replace("size_mm: [150, 100]", "size_mm: [15, 10]"), encoding="utf-8")
    return folder


class _Full:
    """An open file that takes no bytes if ``check`` refuses its path."""

    def __init__(self, stream: Any, path: object, check: Callable[[object], None]) -> None:
        self._stream, self._path, self._check = stream, path, check

    def write(self, data: Any) -> Any:
        """Write, or be refused; the system names no file then."""
        try:
            self._check(self._path)
        except OSError as error:
            raise OSError(error.errno, error.strerror) from None
        return self._stream.write(data)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def __enter__(self) -> _Full:
        self._stream.__enter__()
        return self

    def __exit__(self, *how: object) -> None:
        self._stream.__exit__(*how)


@contextmanager
def refusing(folder: Path, number: int) -> Iterator[None]:
    """Let the system refuse whatever would write below ``folder``; a full disk lets files be made and refuses bytes."""
    full = number == errno.ENOSPC

    def check(path: object) -> None:
        try:
            named = os.fsdecode(path)  # type: ignore[arg-type]  # what is no path is none of these
        except TypeError:
            return
        if folder in (Path(os.path.abspath(named)), *Path(os.path.abspath(named)).parents):
            raise OSError(number, os.strerror(number), named)

    real_open, real_os_open = io.open, os.open

    def opened(file: Any, mode: str = "r", *more: Any, **named: Any) -> Any:
        writes = set(mode) & set("wax+")
        if writes and not full:
            check(file)
        stream = real_open(file, mode, *more, **named)
        return _Full(stream, file, check) if writes and full and not isinstance(file, int) else stream

    def os_opened(path: Any, flags: int, *more: Any, **named: Any) -> int:
        if flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT) and not full:
            check(path)
        return real_os_open(path, flags, *more, **named)

    def refused(real: Callable[..., Any]) -> Callable[..., Any]:
        def call(*words: Any, **named: Any) -> Any:
            for word in words:
                check(word)
            return real(*words, **named)

        return call

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(io, "open", opened)
        patch.setattr(builtins, "open", opened)
        patch.setattr(os, "open", os_opened)
        for name in ("rename", "replace", "link", "symlink", *(() if full else ("mkdir", "truncate"))):
            patch.setattr(os, name, refused(getattr(os, name)))
        yield


def _needs_screen(words: str) -> bool:
    return any(word in words for word in ("egl", "preview", "run ", "demo", "show "))


@pytest.fixture(scope="module")
def egl() -> str | None:
    """Why nothing can be drawn here, None if it can."""
    try:
        open_surface("egl", (8, 8)).close()
    except InputError as error:
        return str(error)
    return None


def _calls() -> Iterator[Any]:
    """Yield one option of each command with one refusal; `make nightly` tries the others.

    With each of the other refusals `make stress`; the demo, which makes its pictures, too.
    """
    first = {called: option for called, option in reversed(WRITES)}
    for place, option in enumerate(WRITES):
        for turn, number in enumerate(REFUSALS):
            seldom = turn != place % len(REFUSALS) or option[0] == "demo"
            marks = [pytest.mark.stress] if seldom else [pytest.mark.nightly] if first[option[0]] != option[1] else []
            yield pytest.param(option, number, id=f"{' '.join(option)} {errno.errorcode[number]}", marks=marks)


@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize(("option", "number"), list(_calls()))
def test_what_cannot_be_written_is_one_line(
    option: tuple[str, str],
    number: int,
    materials: Path,
    egl: str | None,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    cyclopean: Cyclopean,
) -> None:
    words = WRITES[option]
    if egl and _needs_screen(words):
        pytest.skip(egl)
    monkeypatch.chdir(tmp_path)
    out = tmp_path / ("configs" if option == ("compare", "--experiment") else "out")
    shutil.copytree(materials / "results", out) if option == ("seal", "results") else out.mkdir()
    before = sorted(tmp_path.rglob("*"))
    with refusing(out, number):
        told = cyclopean(*words.replace("OUT", str(out)).replace("IN/", f"{materials}/").split(), expect=None)
    assert told.returncode in (1, 2), told.stdout
    lines = [line for line in told.stderr.splitlines() if line.startswith(("error: ", "cyclopean: "))]
    why, remedy = REFUSALS[number]
    assert len(lines) == 1, told.stderr
    assert out.name in lines[0].partition(": ")[2].partition(":")[0], "the file is named first"
    assert why in lines[0]
    assert remedy in lines[0].rpartition("(")[2]
    assert os.strerror(number) not in told.stderr
    assert ".part" not in told.stderr
    made = [path.name for path in sorted(tmp_path.rglob("*")) if path.is_relative_to(out) and path not in before]
    assert [name for name in made if "." in name and not name.endswith(".lock")] == []  # locks stay, empty
    assert not list(tmp_path.rglob("*.part*"))
