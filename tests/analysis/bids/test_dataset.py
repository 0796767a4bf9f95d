"""The folder of an export: whole or not at all, and nothing of anyone else's replaced."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from analysis.bids import export_dataset
from analysis.bids.dataset import check_replaceable, replacing
from analysis.errors import ResultsError

Lab = Any  # conftest.py


def tree(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def test_an_export_replaces_an_export(lab: Lab) -> None:
    lab.session()
    target = lab.folder / "bids"
    export_dataset([lab.folder / "results"], target)
    before = tree(target)
    lab.session(observer="02", session="s2")
    (target / ".DS_Store").write_bytes(b"")
    assert export_dataset([lab.folder / "results"], target).sessions == 2
    assert set(before) < set(tree(target))
    assert (target / "CHANGES").read_text().startswith("1.1.0 ")
    assert "\n1.0.0 " in (target / "CHANGES").read_text()
    assert sorted(path.name for path in lab.folder.iterdir()) == ["bids", "results"]


@pytest.mark.parametrize(
    "added", ["notes.txt", "derivatives/scores.csv", "sub-01/anat/sub-01_T1w.nii", "sourcedata/mine.txt"]
)
def test_what_was_added_to_an_export_is_not_lost(lab: Lab, added: str) -> None:
    lab.session()
    target = lab.folder / "bids"
    export_dataset([lab.folder / "results"], target)
    (target / added).parent.mkdir(parents=True, exist_ok=True)
    (target / added).write_text("mine")
    with pytest.raises(ResultsError, match=added):
        export_dataset([lab.folder / "results"], target)
    assert (target / added).read_text() == "mine"


@pytest.mark.parametrize("content", [None, "{}", "[]", "not json", '{"GeneratedBy": [{"Name": "other"}]}'])
def test_a_folder_that_is_no_export_is_left_alone(lab: Lab, content: str | None) -> None:
    lab.session()
    target = lab.folder / "thesis"
    target.mkdir()
    (target / ("chapter.txt" if content is None else "dataset_description.json")).write_text(content or "words")
    before = tree(target)
    with pytest.raises(ResultsError, match="not an export"):
        export_dataset([lab.folder / "results"], target)
    assert tree(target) == before


def test_a_file_is_no_folder(tmp_path: Path) -> None:
    (tmp_path / "bids").write_text("")
    with pytest.raises(ResultsError, match="this is a file"):
        check_replaceable(tmp_path / "bids")


def test_an_empty_folder_is_taken(lab: Lab) -> None:
    lab.session()
    (lab.folder / "bids").mkdir()
    assert export_dataset([lab.folder / "results"], lab.folder / "bids").sessions == 1


def test_what_fails_half_way_leaves_the_earlier_export_and_nothing_else(lab: Lab) -> None:
    lab.session()
    target = lab.folder / "bids"
    export_dataset([lab.folder / "results"], target)
    before = tree(target)

    def fail() -> None:
        with replacing(target) as part:
            (part / "README").write_text("half")
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert tree(target) == before
    assert sorted(path.name for path in lab.folder.iterdir()) == ["bids", "results"]


def test_the_folder_can_be_read_by_those_who_may_read_its_neighbours_if_asked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CYCLOPEAN_ACCESS", "all")
    (tmp_path / "neighbour").mkdir()
    with replacing(tmp_path / "new"):
        pass
    assert (tmp_path / "new").stat().st_mode == (tmp_path / "neighbour").stat().st_mode
