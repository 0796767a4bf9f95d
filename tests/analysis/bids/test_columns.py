"""Columns: unique names, honest formats."""

from __future__ import annotations

import re
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.bids.columns import FIXED, Column, ColumnCollector, flatten
from analysis.bids.sidecars import describe, trial_type
from tests.answers import new_answer


def gathered(*data: dict[str, Any], kind: str = "odd") -> dict[str, Column]:
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
    for number in range(5000):
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


def column(*place: str, form: str = "number", values: tuple[str, ...] | None = None) -> Column:
    return Column("_".join(place), place, form, False, ("all_pairs",), values)


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
