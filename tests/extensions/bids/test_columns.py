"""Columns, text and the folder of an export; what stations left is merged, and two people with one code are noted."""

from __future__ import annotations

import csv
import io
import json
import re
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analysis.errors import ResultsError
from analysis.kinds import KINDS, ColumnWords, Trial
from analysis.records import Resumption, read_results, refuse_mixtures
from analysis.report.notes import on_sessions
from extensions.bids import export_dataset, unescape
from extensions.bids.columns import FIXED, BidsColumn, ColumnCollector, flatten, roles
from extensions.bids.dataset import check_replaceable, replacing
from extensions.bids.export import time_cell
from extensions.bids.sidecars import describe, trial_type
from extensions.bids.sources import Sources, find_sources, log_files
from extensions.bids.text import cell, escape, inert_json
from tests.answers import changed, new_answer


class LateRecord(Trial):
    """Of a kind that is loaded after the first export."""

    columns: ClassVar[Mapping[str, ColumnWords]] = {"shade": ColumnWords("How dark it was called.")}
    no_stimulus: ClassVar[tuple[str, ...]] = ("shade",)
    shade: str


def test_a_kind_that_is_loaded_late_says_its_columns(monkeypatch: pytest.MonkeyPatch) -> None:
    assert roles({"shade": "a"}, ["a"]) == {"a": "shade"}
    monkeypatch.setitem(KINDS._loaded, "late", LateRecord)
    column = gathered({"shade": "a"}, kind="late")["shade"]
    assert describe(column)["Description"] == LateRecord.columns["shade"].description
    assert roles({"shade": "a"}, ["a"]) == {}


# Columns: unique names, honest formats.
def gathered(*data: dict[str, Any], kind: str = "odd") -> dict[str, BidsColumn]:
    collector = ColumnCollector()
    for number, recorded in enumerate(data):
        collector.add(new_answer(0, number, kind, (), 1.0, "2026-01-02T03:04:05Z", recorded), ())
    columns = collector.columns()
    named = {column.name: column for column in columns}
    assert len(named) == len(columns)
    return named


@given(st.lists(st.dictionaries(st.text(max_size=6), st.integers() | st.text(max_size=3), max_size=6), max_size=4))
def test_names_are_plain_unique_and_described_whatever_the_keys(data: list[dict[str, Any]]) -> None:
    for name, column in gathered(*data).items():
        assert re.fullmatch("[a-z0-9_]+", name)
        assert name not in FIXED
        definition = describe(column)
        assert definition["Description"].endswith(".")
        assert definition["Format"] == column.format


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ((1, 2), "integer"),
        ((1, 2.5), "number"),
        ((True, False), "boolean"),
        ((True, 1), "string"),
        ((1, "x"), "string"),
        ((None, 2), "integer"),
        ((None, None), "string"),
        (([1], [2]), "string"),
    ],
)
def test_a_format_holds_for_every_value(values: tuple[Any, ...], expected: str) -> None:
    assert gathered(*({"a": value} for value in values))["a"].format == expected


def test_keys_that_bids_uses_otherwise_and_keys_that_look_alike_are_kept_apart() -> None:
    columns = gathered({"stim_file": "x", "HED": "y", "onset": 1, "a.b": 2, "a b": 3, "a": {"b": 4}, "": 5, "é": 6})
    assert list(columns) == ["data_stim_file", "data_hed", "data_onset", "a_b", "a_b_2", "a_b_3", "value", "value_2"]


def test_a_mapping_by_name_is_one_column() -> None:
    columns = gathered(*({"by_name": {f"n{number}": 1, f"m{number}": 2}} for number in range(200)))
    assert list(columns) == ["by_name"]
    assert columns["by_name"].holds_json
    assert columns["by_name"].format == "string"


def test_the_collector_keeps_nothing_of_the_trials() -> None:
    collector = ColumnCollector()
    for number in range(500):
        collector.add(
            new_answer(0, number, "odd", (), 1.0, data={"comment": f"words {number}", "rating": number}),
            (),
        )
    (comment, rating) = collector.columns()
    assert comment.values is None
    assert rating.format == "integer"


LEAVES = st.none() | st.booleans() | st.integers() | st.text(max_size=3) | st.lists(st.integers(), max_size=2)
NESTED = st.dictionaries(
    st.text(max_size=3),
    st.recursive(LEAVES, lambda inner: st.dictionaries(st.text(max_size=3), inner, max_size=3), max_leaves=8),
    max_size=4,
)


def rebuilt(places: list[tuple[tuple[str, ...], Any]]) -> dict[str, Any]:
    """The obvious way back."""
    data: dict[str, Any] = {}
    for (*above, last), value in places:
        here = data
        for key in above:
            here = here.setdefault(key, {})
        here[last] = value
    return data


@given(NESTED)
def test_nothing_is_lost(data: dict[str, Any]) -> None:
    assert rebuilt(flatten(data)) == data


@given(NESTED, st.sets(st.text(max_size=3)))
def test_each_place_comes_once_whatever_the_stimuli_are_called(data: dict[str, Any], stimuli: set[str]) -> None:
    places = [place for place, _ in flatten(data, stimuli)]
    assert len(places) == len(set(places))


def test_roles_stand_for_the_stimuli() -> None:
    data = {"first": "a", "second": "b", "chosen": "b", "clipping": {"b": {"left": {"percent_any": 2}}, "a": {"x": 1}}}
    assert dict(flatten(data, {"a", "b", "c"}))["clipping", "second", "left", "percent_any"] == 2
    assert dict(flatten(data, {"a", "b", "c"}))["clipping", "first", "x"] == 1


def test_stimuli_without_a_role_stay_together() -> None:
    data = {"chosen": "b", "dwell_s": {"a": 1.0, "b": 2.0, "c": 3.0}}
    assert flatten(data, {"a", "b", "c"}) == [
        (("chosen",), "b"),
        (("dwell_s", "chosen"), 2.0),
        (("dwell_s", "others"), {"a": 1.0, "c": 3.0}),
    ]


def test_a_stimulus_called_left_does_not_take_an_eyes_place() -> None:
    data = {"first": "left", "second": "b", "clipping": {"first": {"left": 1, "right": 2}}}
    assert dict(flatten(data, {"left", "b"}))["clipping", "first", "left"] == 1


def test_keys_that_are_to_stay_whole_do() -> None:
    assert flatten({"a": {"b": 1}, "c": {"d": 2}}, whole={"a"}) == [(("a",), {"b": 1}), (("c", "d"), 2)]
    nested = {"a": {"b": {"c": {"d": {"e": {"f": {"g": 1}}}}}}}
    assert flatten(nested) == [(("a", "b", "c", "d", "e", "f"), {"g": 1})]  # what is deeper is a value


def test_the_group_of_a_pair_has_a_column_that_says_what_it_is() -> None:
    columns = gathered({"group": "church", "group_factor": "scene"}, {"group": "beach", "group_factor": "scene"})
    assert columns["group"].values == ("church", "beach")
    assert "within which the pair was compared" in describe(columns["group"])["Description"]
    assert "factor" in describe(columns["group_factor"])["Description"]


def test_a_series_that_is_called_as_a_stimulus_takes_no_role_from_it() -> None:
    data = {"series": "b", "chosen": "b", "dwell_s": {"a": 1.0, "b": 2.0}}
    assert dict(flatten(data, {"a", "b"}))["dwell_s", "chosen"] == 2.0
    data = {"answer": "first", "first": "second", "second": "first", "clipping": {"first": 1, "second": 2}}
    assert dict(flatten(data, {"first", "second"}))["clipping", "second"] == 1


def column(*place: str, form: str = "number", values: tuple[str, ...] | None = None) -> BidsColumn:
    return BidsColumn("_".join(place), place, form, False, ("all_pairs",), values)


def test_clip_costs_say_whose_and_which_eyes() -> None:
    percent = describe(column("clipping", "first", "left", "percent_any"))
    assert percent["Units"] == "%"
    assert "'first'" in percent["Description"]
    assert "left eye" in percent["Description"]
    assert describe(column("clipping", "second", "right", "delta_e_00_max"))["Units"] == "1"


def test_units_come_from_names() -> None:
    assert describe(column("dwell_ms"))["Units"] == "ms"
    assert describe(column("dwell_s", "chosen"))["Units"] == "s"
    assert describe(column("shown", "luminance_cd_m2"))["Units"] == "cd/m^2"
    assert "Units" not in describe(column("answers"))
    assert "Units" not in describe(column("words_s", form="string"))


def test_words_of_people_are_no_levels() -> None:
    assert "Levels" not in describe(column("answer", form="string", values=("first", "I like it")))


def test_levels_hold_every_value() -> None:
    levels = describe(column("answer", form="string", values=("first", "second", "not_sure")))["Levels"]
    assert list(levels) == ["first", "second", "not_sure"]
    assert "Levels" not in describe(column("answer", form="string"))


def test_unknown_columns_and_kinds_are_described_by_name() -> None:
    assert "'gloss_units'" in describe(column("gloss_units"))["Description"]
    assert "sorting" in trial_type(("all_pairs", "sorting\t"))["Levels"]["sorting\\t"]


# Text in tables: inert, and given back exactly.

ANY_TEXT = st.text(st.characters(exclude_categories=())) | st.text(
    "\\\"'=+-@nu/a \t\r\n\u202e\u2028\x85\x00", max_size=8
)
JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4),
    max_leaves=12,
)
ACTIVE = ["\t", "\n", "\r", "\x00", "\x1b", "\x7f", "\x85", "\u202e", "\u2066", "\u200f", "\u2028", "\u2029", "\ufeff"]


@given(ANY_TEXT)
def test_a_cell_is_one_visible_line_and_no_formula(text: str) -> None:
    line = escape(text)
    assert line not in ("", "n/a")
    assert len(line.splitlines()) == 1
    assert not any(character in line for character in ACTIVE)
    assert line == '""' or line.lstrip()[:1] not in tuple('"=+-@')
    line.encode("utf-8")


@given(st.lists(ANY_TEXT, min_size=1, max_size=4))
def test_readers_that_know_quotes_see_the_same_cells(texts: list[str]) -> None:
    line = "\t".join(map(escape, texts))
    (read,) = csv.reader(io.StringIO(line + "\n", newline=""), delimiter="\t")
    assert [unescape(cell or '""') for cell in read] == texts


@settings(max_examples=15)
@given(JSON)
def test_json_comes_back_and_is_inert(value: Any) -> None:
    for indent in (None, 2):
        text = inert_json(value, indent)
        assert json.loads(text) == value
        assert not any(character in text.replace("\n", "") for character in ACTIVE)
        assert indent or "\n" not in text
        text.encode("utf-8")


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (None, "n/a"),
        (True, "true"),
        (False, "false"),
        (3, "3"),
        (-0.25, "-0.25"),
        (1e-7, "1e-07"),
        (float("nan"), "NaN"),
        (float("-inf"), "\\u002dInfinity"),
        ("n/a", "n\\u002fa"),
        ("", '""'),
        ("a\tb\nc", "a\\tb\\nc"),
        ("\u202egnp", "\\u202egnp"),
        ("=1+1", "\\u003d1+1"),
        (" -x", " \\u002dx"),
        ("\U000e0041", "\\U000e0041"),
        ("ΔE – gut", "ΔE – gut"),
        ([["up", 1.5]], '[["up",1.5]]'),
        ({"a": "x\ty\u202e\x7f"}, '{"a":"x\\ty\\u202e\\u007f"}'),
        ({"a": float("nan")}, '{"a":"NaN"}'),
    ],
)
def test_cells_are_written_as_documented(value: Any, expected: str) -> None:
    assert cell(value) == expected


START = "2026-01-02T03:04:05+00:00"


def test_only_a_time_of_day_is_written_as_one() -> None:
    assert time_cell(START) == START
    assert time_cell("2026-01-02T03:04:05.123456Z") == "2026-01-02T03:04:05.123456Z"
    assert time_cell("2026") == time_cell(None) == time_cell("2026-01-02T03:04:05Z\n") == "n/a"


# The folder of an export: whole or not at all, and nothing of anyone else's replaced.

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


# Merging what stations left.


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


# Two people with one code are noted in report and export, and parted by renaming a folder.

MONDAY, TUESDAY = "20260102T030400", "20260103T030400"


def notes(*places: Path) -> list[str]:
    """Return the report's and the export's notes on codes, which are the same."""
    reported = [note for note in on_sessions(read_results(*places)) if "code" in note or "counted as" in note]
    exported = list(export_dataset(places, places[0].parent / "dataset").doubts)
    assert reported == exported
    return reported


def leave(lab: Lab, station: str = "results", session: str = f"{MONDAY}abcd", **more: Any) -> Path:
    """Leave a session of a person, begun when its label says."""
    day = session[6:8]
    made = [changed(lab.pair(number), utc=f"2026-01-{day}T03:0{number + 4}:30.000+00:00") for number in range(3)]
    begun = f"2026-01-{day}T03:04:00+00:00"
    values = {"records": made, "simulated": False, "started_utc": begun, **more}
    file: Path = lab.session(station=station, session=session, **values)
    return file


def test_sessions_on_two_stations_are_noted_with_the_remedy(lab: Lab, tmp_path: Path) -> None:
    leave(lab, recorded_on="aaaa1111")
    leave(lab, session=f"{TUESDAY}efgh", recorded_on="bbbb2222")
    leave(lab, session=f"{TUESDAY}efgh", recorded_on="bbbb2222", observer="02")
    (note,) = notes(tmp_path / "results")
    assert note.startswith("Observer 01 may be two people")
    assert "2 stations (aaaa1111, bbbb2222)" in note
    assert "rename the folder of one, sub-01" in note


def test_a_renamed_folder_parts_them_and_the_dataset_keeps_it(lab: Lab, tmp_path: Path) -> None:
    leave(lab, "a", recorded_on="aaaa1111")
    file = leave(lab, "b", f"{TUESDAY}efgh", recorded_on="bbbb2222")
    before = file.read_bytes()
    file.parents[1].rename(file.parents[1].with_name("sub-01b"))
    (told,) = notes(tmp_path / "a", tmp_path / "b")
    assert "observer 01 are counted as 01b" in told
    assert {log.header.observer for log in read_results(tmp_path / "a", tmp_path / "b")} == {"01", "01b"}
    dataset = tmp_path / "dataset"
    assert (dataset / "participants.tsv").read_text().split()[2::2] == ["sub-01", "sub-01b"]
    (copied,) = (dataset / "sourcedata").rglob("sub-01b/*/session.jsonl")
    assert copied.read_bytes() == before
    assert {log.header.observer for log in read_results(dataset / "sourcedata")} == {"01", "01b"}


def test_sessions_at_the_same_time_are_noted(lab: Lab, tmp_path: Path) -> None:
    leave(lab)
    leave(lab, session=f"{MONDAY}efgh")
    (note,) = notes(tmp_path / "results")
    assert f"sessions overlap in time ({MONDAY}abcd and {MONDAY}efgh)" in note


def test_a_session_between_stop_and_resumption_does_not_overlap(lab: Lab, tmp_path: Path) -> None:
    stopped = [changed(lab.pair(0), utc="2026-01-02T03:10:00+00:00")]
    later = [changed(lab.pair(1), utc="2026-01-04T03:10:00+00:00")]
    leave(lab, records=[*stopped, Resumption(utc="2026-01-04T03:00:00+00:00"), *later])
    leave(lab, session=f"{TUESDAY}efgh")
    assert notes(tmp_path / "results") == []


def test_old_logs_in_two_folders_of_results_are_noted(lab: Lab, tmp_path: Path) -> None:
    leave(lab, "a")
    leave(lab, "b", f"{TUESDAY}efgh")
    (note,) = notes(tmp_path / "a", tmp_path / "b")
    assert f"({tmp_path / 'a'}, {tmp_path / 'b'})" in note


def test_nothing_is_noted_of_one_station_or_of_simulated_observers(lab: Lab, tmp_path: Path) -> None:
    leave(lab, "a", recorded_on="aaaa1111")
    leave(lab, "b", f"{TUESDAY}efgh", recorded_on="aaaa1111")
    for station in ("a", "b"):
        leave(lab, station, f"{MONDAY}{station * 4}", observer="sim", simulated=True)
    assert notes(tmp_path / "a", tmp_path / "b") == []


def test_a_copy_under_another_code_is_no_second_person(lab: Lab, tmp_path: Path) -> None:
    file = leave(lab)
    copy = tmp_path / "results/dynamic_range/sub-02" / file.parent.name / file.name
    copy.parent.mkdir(parents=True)
    copy.write_bytes(file.read_bytes())
    done = export_dataset([tmp_path / "results"], tmp_path / "dataset")
    assert (done.participants, len(done.copies)) == (1, 1)
    with pytest.raises(ResultsError, match="its answers would count twice"):
        refuse_mixtures(read_results(tmp_path / "results"))
