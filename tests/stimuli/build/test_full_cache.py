"""A full cache: the folder, what is free and wanted, and the remedy are named, and nothing unfinished is left."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest
from PIL import Image

from documents import InputError
from documents.files import unwritable, what_stopped
from stimuli.build import build_set, export_exr
from stimuli.errors import StimulusError
from stimuli.pictures import StereoImage, write_exr

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
