"""Paths without detours: always the same file, and plain where it certainly is."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from documents.files import beside, tidy


@pytest.fixture
def folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the folder that is gone into: folders a/b, c, a file in each, and links to a/b and to itself."""
    for name in ("a/b", "c"):
        (tmp_path / name).mkdir(parents=True)
    for name in ("f", "a/f", "a/b/f", "c/f"):
        (tmp_path / name).write_text(name)
    (tmp_path / "c/link").symlink_to(tmp_path / "a/b")
    (tmp_path / "here").symlink_to(".")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.usefixtures("folders")
@pytest.mark.parametrize(
    ("path", "plain"),
    [
        ("a/../c/f", "c/f"),
        ("a/b/../../c/f", "c/f"),
        ("./a/../f", "f"),
        ("../x/f", "../x/f"),
        ("a/../../f", "../f"),
        ("c/link/../f", "c/link/../f"),  # a/f, not c/f
        ("none/../f", "none/../f"),  # not there to be gone through
        ("f/../c/f", "f/../c/f"),  # a file is no way through
    ],
)
def test_detours(path: str, plain: str) -> None:
    assert tidy(Path(path)) == Path(plain)


def test_absolute_paths_keep_their_root(folders: Path) -> None:
    assert tidy(folders / "a" / ".." / "f") == folders / "f"
    assert tidy(Path("/../f")) == Path("/../f")


def test_a_name_in_a_file_is_relative_to_the_file_s_folder(folders: Path) -> None:
    assert beside(Path("a/x.yaml"), "../c/f") == Path("c/f")
    assert beside(Path("a/x.yaml"), str(folders / "f")) == folders / "f"


def test_it_is_always_the_same_file(folders: Path) -> None:
    @settings(deadline=None)  # the first call of a busy disk
    @given(st.lists(st.sampled_from(["a", "b", "c", "link", "here", "..", ".", "none"]), max_size=6))
    def always(parts: list[str]) -> None:
        path = Path(*parts, "f")
        assert path.exists() == tidy(path).exists()
        assert not path.exists() or os.path.samefile(path, tidy(path))

    always()
