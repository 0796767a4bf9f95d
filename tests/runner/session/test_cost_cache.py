"""A cached cost is read as it was computed, or not at all, and writing it never stops a session."""

from __future__ import annotations

import errno
import json
import math
import os
from collections.abc import Callable
from pathlib import Path

import pytest

from runner.session.clipping_costs import CostCache

DEPENDS = {"version": 1, "picture": "ab" * 32, "places_px": ((0, -60), (0, 60)), "lift_share": 0.1}
COST = {"flat": False, "clipping": {"left": {"percent_any": 0.1234, "delta_e_00_mean": 1e-5}}}


def _only(folder: Path) -> Path:
    (file,) = folder.iterdir()
    return file


def test_what_was_kept_is_found_by_all_that_it_depends_on(tmp_path: Path) -> None:
    folder = tmp_path / "deep" / "costs"
    assert CostCache(folder).find(DEPENDS) is None
    assert CostCache(folder).keep(DEPENDS, COST)
    assert CostCache(folder).find(DEPENDS) == COST
    assert CostCache(folder).find({**DEPENDS, "places_px": [[0, -60], [0, 60]]}) == COST  # as JSON has it
    for other in ({"version": 2}, {"lift_share": math.nextafter(0.1, 1.0)}, {"places_px": ((0, -60),)}, {"more": None}):
        assert CostCache(folder).find({**DEPENDS, **other}) is None


def _as(data: object) -> Callable[[str], str]:
    return lambda text: json.dumps(data)


@pytest.mark.parametrize(
    "damage",
    [
        lambda text: "",
        lambda text: text[: len(text) // 2],
        lambda text: text.replace("0.1234", "0.1235"),
        lambda text: text.replace('"lift_share": 0.1', '"lift_share": 0.2'),
        lambda text: text.replace('"sha256"', '"sha265"'),
        lambda text: text.replace("false", "NaN"),
        lambda text: "[" * 100_000,
        lambda text: "\0" * len(text),
        _as([]),
        _as(None),
        _as({"depends_on": None, "cost": None, "sha256": None}),
    ],
)
def test_a_damaged_file_is_as_good_as_none_and_is_written_again(tmp_path: Path, damage: Callable[[str], str]) -> None:
    cache = CostCache(tmp_path)
    cache.keep(DEPENDS, COST)
    file = _only(tmp_path)
    text = file.read_text()
    assert damage(text) != text
    file.write_text(damage(text))
    assert cache.find(DEPENDS) is None
    assert cache.keep(DEPENDS, COST)
    assert cache.find(DEPENDS) == COST


def test_a_file_that_is_no_text_or_no_file_is_as_good_as_none(tmp_path: Path) -> None:
    cache = CostCache(tmp_path)
    cache.keep(DEPENDS, COST)
    file = _only(tmp_path)
    file.write_bytes(b"\xff\xfe")
    assert cache.find(DEPENDS) is None
    file.unlink()
    file.mkdir()
    assert cache.find(DEPENDS) is None
    assert not cache.keep(DEPENDS, COST)
    assert _only(tmp_path) == file


def test_a_folder_that_cannot_be_written_is_not_in_the_way(tmp_path: Path) -> None:
    (tmp_path / "costs").write_text("a file where the folder should be")
    cache = CostCache(tmp_path / "costs")
    assert not cache.keep(DEPENDS, COST)
    assert cache.find(DEPENDS) is None


@pytest.mark.parametrize("refused", ["os.replace", "Path.write_bytes"])
def test_a_full_disk_is_not_in_the_way_and_nothing_is_left_of_the_attempt(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, refused: str
) -> None:
    def fail(path: Path, *_: object) -> None:
        if refused == "Path.write_bytes":
            path.touch()  # the disk took the name, and nothing of the content
        raise OSError(errno.ENOSPC, "No space left on device")

    owner, _, name = refused.partition(".")
    monkeypatch.setattr({"os": os, "Path": Path}[owner], name, fail)
    assert not CostCache(tmp_path).keep(DEPENDS, COST)
    assert not list(tmp_path.iterdir())


def test_what_a_killed_program_left_is_removed_and_what_another_is_writing_is_not(tmp_path: Path) -> None:
    left, writing = tmp_path / ".ab-x.part", tmp_path / ".ab-y.part"
    for part in (left, writing):
        part.write_text('{"depends')
    os.utime(left, (0, 0))
    cache = CostCache(tmp_path)
    assert cache.find(DEPENDS) is None
    assert cache.keep(DEPENDS, COST)
    assert not left.exists()
    assert writing.exists()
