"""Merging what stations left."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest

from analysis.bids.sources import Sources, find_sources, log_files
from analysis.errors import ResultsError

Lab = Any  # conftest.py


def found(*places: Path) -> Sources:
    return find_sources(log_files(places, Path("/nowhere")), lambda source, log: None)


def refused(*places: Path) -> str:
    with pytest.raises(ResultsError) as told:
        found(*places)
    return str(told.value)


def test_copies_are_taken_once_and_told(lab: Lab) -> None:
    kept = lab.session()
    lab.session(observer="02", session="s2")
    copy = lab.folder / "other" / "deep" / "session.jsonl"
    copy.parent.mkdir(parents=True)
    shutil.copy(kept, copy)
    both = found(lab.folder / "results", lab.folder / "other")
    assert [source.observer for source in both.sources] == ["01", "02"]
    assert both.copies == ((kept, copy),)


def test_a_file_named_twice_is_no_copy(lab: Lab) -> None:
    file = lab.session()
    assert found(file, lab.folder, file.parent).copies == ()


def test_what_a_killed_export_left_behind_is_no_result(lab: Lab) -> None:
    kept = lab.session()
    shutil.copytree(kept.parent, lab.folder / "results" / ".bids.abc.part" / "sourcedata")
    assert found(lab.folder / "results").copies == ()


def test_the_order_of_the_folders_decides_nothing(lab: Lab) -> None:
    lab.session(observer="02", station="a", session="s1")
    lab.session(observer="01", station="b", session="s2")
    folders = [lab.folder / "a", lab.folder / "b"]
    assert found(*folders).sources == found(*reversed(folders)).sources


def test_other_content_under_the_same_labels_names_both_files(lab: Lab) -> None:
    one = lab.session(station="a")
    two = lab.session([lab.pair(2, trial=0)], station="b")
    told = refused(lab.folder)
    assert str(one) in told
    assert str(two) in told
    assert "check which of them is right" in told


def test_a_copy_taken_before_the_session_was_done_is_recognised(lab: Lab) -> None:
    lab.session(station="a", complete=False)
    whole = lab.session(station="b")
    assert f"keep {whole}" in refused(lab.folder)


@pytest.mark.parametrize("label", ["../../etc", "a_b", "", "ä", "a" * 65, "01\n"])
def test_what_is_no_label_is_refused(lab: Lab, label: str) -> None:
    file = lab.session()
    file.write_text(file.read_text().replace('"observer": "01"', f'"observer": {_json(label)}'))
    assert ("is not a BIDS label" if label else "'observer' is \"\"") in refused(file)


def _json(text: str) -> str:
    import json

    return json.dumps(text)


@pytest.mark.parametrize("name", ["__", "", 7, None])
def test_an_experiment_without_letters_has_no_label(lab: Lab, name: object) -> None:
    assert ("the experiment" if name == "__" else "'experiment' is ") in refused(lab.session(experiment=name))


def test_two_experiments_with_one_label_are_refused(lab: Lab) -> None:
    one = lab.session()
    two = lab.session(station="b", observer="02", session="s2", experiment="Dynamic-range")
    told = refused(lab.folder)
    assert "'Dynamic-range' and 'dynamic_range'" in told or "'dynamic_range' and 'Dynamic-range'" in told
    assert str(one) in told
    assert str(two) in told


def test_labels_that_differ_only_in_case_are_refused(lab: Lab) -> None:
    lab.session(observer="ab", session="s1", station="a")
    lab.session(observer="AB", session="s2", station="b")
    assert "only in upper and lower case" in refused(lab.folder)


def test_every_fault_is_told_at_once(lab: Lab) -> None:
    lab.session(observer="01", session="s1").write_text("nonsense\n")
    lab.session(observer="02", session="s2").write_bytes(b"\xff\n")
    with pytest.raises(ResultsError) as told:
        found(lab.folder)
    assert len(told.value.findings) == 2


@pytest.mark.parametrize("key", ["display", "hashes", "software", "presentation"])
def test_a_header_that_something_else_wrote_is_refused(lab: Lab, key: str) -> None:
    assert f"'{key}' is " in refused(lab.session(**{key: ["x"]}))


def test_a_record_that_never_ends_to_nest_is_refused(lab: Lab) -> None:
    file = lab.session()
    file.write_text(file.read_text() + '{"record": "trial", "x": ' + "[" * 100_000 + "\n")
    assert str(file) in refused(file)


def test_places_without_sessions_are_told(lab: Lab) -> None:
    (lab.folder / "empty").mkdir()
    told = refused(lab.folder / "empty", lab.folder / "nowhere")
    assert "holds no session.jsonl" in told
    assert "there is no such folder" in told
