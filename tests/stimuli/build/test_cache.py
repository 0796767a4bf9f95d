"""The cache of sets: its lock, a full disk, hashes that are relied on, and pixels counted in bands."""

from __future__ import annotations

import errno
import hashlib
import json
import multiprocessing
import os
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest
from filelock import Timeout
from PIL import Image

import stimuli.build.stimulus_set
import stimuli.pictures.exr_write
from devices.display import read_rig
from documents import InputError, counted_work
from documents.files import unwritable, what_stopped
from stimuli.build import StimulusSet, build_set, export_exr
from stimuli.build.cache import locked
from stimuli.build.known_hashes import KnownHashes
from stimuli.build.report import saturated_percent
from stimuli.errors import StimulusError
from stimuli.luminance.saturation import measure_saturation
from stimuli.pictures import StereoImage, write_exr
from stimuli.recipes import DisplaySetup


# The lock of a set: one at a time, whoever comes and goes, and nothing left.
def count_up(folder: Path, times: int) -> None:
    """Read a number and write the next, under the lock: none is lost if only one does so at a time."""
    number = folder / "number"
    for _ in range(times):
        with locked(folder / "set"):
            number.write_text(str(int(number.read_text()) + 1))


@pytest.mark.nightly
def test_processes_take_turns_though_each_removes_the_file(tmp_path: Path) -> None:
    (tmp_path / "number").write_text("0")
    other = multiprocessing.get_context("spawn").Process(target=count_up, args=(tmp_path, 200))
    other.start()
    with ThreadPoolExecutor(2) as pool:
        assert list(pool.map(lambda _: count_up(tmp_path, 200), range(2))) == [None, None]
    other.join()
    assert other.exitcode == 0
    assert (tmp_path / "number").read_text() == "600"
    assert [path.name for path in tmp_path.iterdir()] == ["number"]


def test_a_lock_that_is_held_is_not_waited_for_where_none_is_to(tmp_path: Path) -> None:
    with locked(tmp_path / "set"), pytest.raises(Timeout), locked(tmp_path / "set", wait=False):
        pass
    with pytest.raises(ZeroDivisionError), locked(tmp_path / "set", wait=False):
        raise ZeroDivisionError
    assert list(tmp_path.iterdir()) == []


# A full cache: the folder, what is free and wanted, and the remedy are named, and nothing unfinished is left.

RECIPE = "schema_version: 1\nkind: pictures\ncolour_space: srgb\nwhite_luminance_cd_m2: 100\n"
NOISE = np.random.default_rng(3).random((200, 300, 3)).astype(np.float32)

LIMITED = """
import resource, signal, sys
from pathlib import Path
from typing import Any
import numpy as np
from documents import InputError
from stimuli.build import build_set
from stimuli.pictures import StereoImage, write_exr

signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, resource.RLIM_INFINITY))
try:
    build_set(Path(sys.argv[1]), 0.25)
except InputError as error:
    print(*error.findings)
"""


@pytest.fixture
def recipe(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / "cache"))
    Image.fromarray(np.full((40, 60, 3), 99, np.uint8)).save(tmp_path / "a.png")
    write_exr(tmp_path / "b.exr", StereoImage.flat(NOISE))
    path = tmp_path / "recipe.yaml"
    path.write_text(f"{RECIPE}stimuli: [{{name: a, file: a.png}}, {{name: b, file: b.exr, colour_space: declared}}]")
    return path


def _files(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.rglob("*") if path.is_file() and path.suffix != ".lock")


@pytest.mark.parametrize(
    ("number", "words"),
    [
        (
            errno.ENOSPC,
            r"disk of the folder .*cache is full \(.* free, up to .* MB wanted\)",
        ),
        (errno.EROFS, r"folder .*cache may only be read"),
        (errno.EIO, r"the disk.* failed \(EIO\)"),
    ],
)
def test_what_a_build_could_not_write_is_named(
    recipe: Path, monkeypatch: pytest.MonkeyPatch, number: int, words: str
) -> None:
    def full(self: Path, *args: Any, **options: Any) -> Any:
        if ".part" in self.name:
            raise OSError(number, os.strerror(number))
        return opened(self, *args, **options)

    opened: Any = Path.open
    monkeypatch.setattr(Path, "open", full)
    with pytest.raises(InputError, match=f"'a' cannot be written: .*{words}") as caught:
        build_set(recipe, 0.25)
    monkeypatch.undo()
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(recipe.parent / "cache"))
    assert len(caught.value.findings) == 1
    assert _files(recipe.parent / "cache") == []
    assert build_set(recipe, 0.25).names == ("a", "b")


def test_an_export_that_could_not_be_written_is_named(recipe: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    built = build_set(recipe, 0.25)

    def full(*args: object, **options: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("stimuli.build.report.shutil.copyfile", full)
    with pytest.raises(InputError, match="light: the exported pictures cannot"):
        export_exr(built, recipe.parent / "light")
    assert not [path for path in recipe.parent.iterdir() if "light" in path.name]


@pytest.mark.nightly
@pytest.mark.skipif(sys.platform == "win32", reason="no limit on the size of files")
def test_openexr_says_why_its_output_failed(recipe: Path) -> None:
    done = subprocess.run([sys.executable, "-c", LIMITED, str(recipe)], capture_output=True, text=True, check=True)
    assert "the picture of the stimulus 'b' cannot be written: files in the folder" in done.stdout, done
    assert "may not become as large (name another folder in the environment variable CYCLOPEAN_CACHE)" in done.stdout
    assert "File output failed" not in done.stdout
    assert _files(recipe.parent / "cache") == []


def test_what_a_library_says_that_is_not_utf_8_is_text(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Refusing:
        def open(self, *args: object) -> bool:
            return False

        def write_scanlines(self, *args: object) -> bool:
            return False

        def close(self) -> bool:
            return False

        def geterror(self) -> str:
            return b"no \xff\x1b[2Jroom".decode()

    monkeypatch.setattr(oiio.ImageOutput, "create", lambda name: Refusing())
    with pytest.raises(StimulusError, match="cannot be written: no �") as caught:
        write_exr(tmp_path / "a.exr", StereoImage.flat(NOISE))
    assert str(caught.value).isprintable()
    assert list(tmp_path.iterdir()) == []


def test_a_disk_that_takes_more_stopped_nothing(tmp_path: Path) -> None:
    assert what_stopped(tmp_path / "draft") is None
    missing = what_stopped(tmp_path / "none" / "draft")
    assert missing is not None
    assert "may only be read" not in str(unwritable(missing, tmp_path, "picture"))


# Hashes that are relied on: only of files that nobody can have touched since.
def aged(path: Path, monkeypatch: pytest.MonkeyPatch, seconds: float = 10.0) -> None:
    """Let the clock stand later, as it would if the file had lain still for so long."""
    now = time.time_ns
    monkeypatch.setattr("stimuli.build.known_hashes.time.time_ns", lambda: now() + int(seconds * 1e9))


def known(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    file = tmp_path / "a.bin"
    file.write_bytes(b"first")
    aged(file, monkeypatch)
    hashes = KnownHashes(tmp_path / "record.json")
    assert hashes.sha256(file) == hashlib.sha256(b"first").hexdigest()
    assert hashes.hashed == 1
    hashes.keep()
    return file


def test_a_file_that_lay_still_is_not_read_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = known(tmp_path, monkeypatch)
    again = KnownHashes(tmp_path / "record.json")
    assert again.sha256(file) == hashlib.sha256(b"first").hexdigest()
    assert again.hashed == 0
    verified = KnownHashes(tmp_path / "record.json", verify=True)
    verified.sha256(file)
    assert verified.hashed == 1


def in_place_with_its_time_set_back(file: Path) -> None:
    before = file.stat()
    file.write_bytes(b"other")
    os.utime(file, ns=(before.st_atime_ns, before.st_mtime_ns))


def replaced_with_its_time_set_back(file: Path) -> None:
    before = file.stat()
    other = file.with_name("b.bin")
    other.write_bytes(b"other")
    os.utime(other, ns=(before.st_atime_ns, before.st_mtime_ns))
    other.replace(file)


def longer(file: Path) -> None:
    file.write_bytes(b"first and more")


@pytest.mark.parametrize("change", [in_place_with_its_time_set_back, replaced_with_its_time_set_back, longer])
def test_whatever_changed_is_read_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, change: Callable[[Path], None]
) -> None:
    file = known(tmp_path, monkeypatch)
    change(file)
    assert KnownHashes(tmp_path / "record.json").sha256(file) == hashlib.sha256(file.read_bytes()).hexdigest()


def test_a_file_just_written_is_not_relied_on(tmp_path: Path) -> None:
    file = tmp_path / "a.bin"
    file.write_bytes(b"first")
    hashes = KnownHashes(tmp_path / "record.json")
    hashes.sha256(file)
    hashes.keep()
    assert not (tmp_path / "record.json").exists()
    hashes.sha256(file)
    assert hashes.hashed == 2


@pytest.mark.parametrize("record", ["", "{", "[]", '{"a": 1}', '{"a": [1, 2]}'])
def test_a_damaged_record_costs_time_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, record: str) -> None:
    file = known(tmp_path, monkeypatch)
    (tmp_path / "record.json").write_text(record)
    assert KnownHashes(tmp_path / "record.json").sha256(file) == hashlib.sha256(b"first").hexdigest()


def test_a_record_that_lies_is_found_out_by_verify(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = known(tmp_path, monkeypatch)
    record = json.loads((tmp_path / "record.json").read_text())
    record[str(file)][-1] = "0" * 64
    (tmp_path / "record.json").write_text(json.dumps(record))
    assert KnownHashes(tmp_path / "record.json").sha256(file) == "0" * 64
    assert KnownHashes(tmp_path / "record.json", verify=True).sha256(file) != "0" * 64


# The pixels of a built set that a display cannot show bright enough: large pictures are counted in bands of rows.

ROOT = Path(__file__).parents[3]
SETUP = DisplaySetup.of(read_rig(ROOT / "configs/rigs/asus_vg248qe_3dvision.yaml"))
SIZE_PX = 40, 700  # 700 rows are three bands of 256 at most


@pytest.fixture
def built(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> StimulusSet:
    """A stereo pair, a flat picture, and codes of one that no step changes."""
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / "cache"))
    random = np.random.default_rng(3)
    width, height = SIZE_PX
    left, right = (1.1 * SETUP.models.left.xyz(random.random((2, height, width, 3)))).astype(np.float32)
    left[: height // 2] *= 0.1
    write_exr(tmp_path / "pair.exr", StereoImage(left, right))
    write_exr(tmp_path / "flat.exr", StereoImage.flat(right))
    Image.fromarray(random.integers(0, 256, (height, width, 3), dtype=np.uint8)).save(tmp_path / "codes.png")
    recipe = {
        "schema_version": 1,
        "kind": "pictures",
        "white_luminance_cd_m2": round(1.2 * float(SETUP.models.left.white_XYZ_cd_m2[1]), 3),
        "stimuli": [
            {"name": "pair", "file": "pair.exr"},
            {"name": "flat", "file": "flat.exr"},
            {"name": "codes", "file": "codes.png", "colour_space": "srgb"},
        ],
    }
    (tmp_path / "recipe.yaml").write_text(json.dumps(recipe), encoding="utf-8")
    return build_set(tmp_path / "recipe.yaml", 0.2768)


def test_bands_of_rows_are_counted_as_the_whole(built: StimulusSet, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = {
        name: {
            eye: measure_saturation(image.eye(eye), SETUP.models.eye(eye), half=image.half).to_json()
            for eye in ("left", "right")
        }
        for name, image in ((name, built.load(name)) for name in built.names)
    }
    assert all(0 < each[eye]["any"] < 100 for each in whole.values() for eye in each)
    assert whole["pair"]["left"] != whole["pair"]["right"]
    monkeypatch.setattr(stimuli.build.stimulus_set, "LEAST_PX", SIZE_PX[0] * SIZE_PX[1])
    monkeypatch.setattr(stimuli.pictures.exr_write, "_BAND_PX", 1)
    assert [read().height_px for read in built.bands("codes")] == [256, 256, 188]
    with counted_work() as work:
        assert saturated_percent(built, SETUP) == whole
    assert (work["pictures_read"], work["parts_of_pictures_read"]) == (0, 6)
    with counted_work() as work:
        assert saturated_percent(built, SETUP) == whole
    assert not work["parts_of_pictures_read"]


def test_a_small_picture_is_read_once_and_whole(built: StimulusSet) -> None:
    with counted_work() as work:
        saturated_percent(built, SETUP)
    assert (work["pictures_read"], work["parts_of_pictures_read"]) == (2, 0)
