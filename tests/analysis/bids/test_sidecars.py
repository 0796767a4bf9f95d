"""Every column is described; units and levels where they are known."""

from __future__ import annotations

from analysis.bids.columns import Column
from analysis.bids.sidecars import describe, trial_type


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
