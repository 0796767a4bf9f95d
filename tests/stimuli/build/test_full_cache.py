"""A full cache: the folder, what is free and wanted, and the remedy are named, and nothing unfinished is left."""

from __future__ import annotations

import errno
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from documents import InputError
from stimuli.build import build_set, export_exr
from stimuli.pictures import StereoImage, write_exr

RECIPE = "schema_version: 1\nkind: pictures\ncolour_space: srgb\nwhite_luminance_cd_m2: 100\n"
NOISE = np.random.default_rng(3).random((200, 300, 3)).astype(np.float32)


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

    monkeypatch.setattr("stimuli.build.export.shutil.copyfile", full)
    with pytest.raises(InputError, match="light: the exported pictures cannot"):
        export_exr(built, recipe.parent / "light")
    assert not [path for path in recipe.parent.iterdir() if "light" in path.name]
