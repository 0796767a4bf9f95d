"""A DataFrame of comparisons is read as the CSV that pandas writes of it: the same answers, the same findings."""

from __future__ import annotations

import io
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pandas.core.generic import NDFrame

import cyclopean as notebook
from analysis.comparisons import Comparisons, read_any, sources
from cyclopean.scaling import comparisons
from documents import Finding, InputError

FILE = "the DataFrame, as CSV"
NAMES = ["a", "b", " b", "c, d", 'e "f"', "NA", "", "g\nh", "x\u2028y", "nan"]
MANY = ["a", "b", "c", "d"]


def as_csv(frame: pd.DataFrame, file: str, *, keep_na: bool, **options: Any) -> Comparisons:
    """Return what the reader of CSV makes of the frame as text: the slow, obvious twin."""

    def number(value: Any) -> str:
        return f"{value:.0f}" if float(value).is_integer() else repr(float(value))

    for column in frame.select_dtypes("category"):  # categories have the names that their values have elsewhere
        frame = frame.assign(**{str(column): pd.Series(frame[column].tolist(), index=frame.index)})
    index = frame.index.name is not None or set(frame.index.astype(str)) == set(frame.columns.astype(str))
    text = frame.to_csv(index=index, na_rep="" if keep_na else "NA", float_format=number, lineterminator="\n")
    return read_any(io.StringIO(text, newline=""), file, keep_na=keep_na, **options).warned()


def outcome(read: Any, *arguments: Any, **options: Any) -> tuple[list[Any], list[Finding], list[str]]:
    """Return the answers that were read, or what is wrong with them, and what was warned of."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        try:
            told = read(*arguments, **options)
        except InputError as wrong:
            return [], list(wrong.findings), [str(each.message) for each in said]
    tied = told.tied
    arrays = [told.winner, told.loser, told.observer, told.count, told.winner_was_first, told.group]
    arrays += [tied.item_a, tied.item_b, tied.observer, tied.count, tied.a_was_first, tied.group]
    answers = [told.items, told.observers, told.groups, *(array.tolist() for array in arrays)]
    return answers, [], [str(each.message) for each in said]


def agree(frame: pd.DataFrame, *, keep_na: bool = False, **options: Any) -> tuple[list[Any], list[Finding], list[str]]:
    """Return what both readers say of a frame, which must be the same."""
    by_frame = outcome(comparisons, frame, keep_na=keep_na, **options)
    assert by_frame == outcome(as_csv, frame, FILE, keep_na=keep_na, **options)
    return by_frame


@settings(max_examples=40, deadline=None)
@given(st.data(), st.integers(1, 9), st.booleans(), st.booleans())
def test_a_frame_says_what_its_csv_says(data: st.DataObject, block: int, keep_na: bool, sound: bool) -> None:
    """Half of the tables have only what is no fault, so that many are read to their ends."""
    name = st.sampled_from(MANY if sound else [*NAMES, None])
    missing = st.sampled_from([None, "NA", "a", ""])
    columns: dict[str, st.SearchStrategy[Any]] = {
        "winner": name,
        "loser": name.map(lambda text: text if text is None else f"{text}'") if sound else name,
        "count": st.sampled_from([1.0, 0.5, 0.0, 3.0] if sound else [1.0, 0.0, -1.0, np.nan, np.inf]),
        "observer": st.sampled_from([1.0, 2.0, 12.5, np.nan, np.nan] if sound else ["01", "2 ", None, " "]),
        "first": st.sampled_from([None, "NA", ""]) if sound else missing,
        "outcome": st.sampled_from(["win", "tie", "", " tie", None]),
        "scene": st.sampled_from(["x", " x", "y"] if sound else ["x", None, "", " "]),
    }
    beside = data.draw(st.lists(st.sampled_from(list(columns)[2:]), unique=True))
    rows = data.draw(st.integers(0, 25))
    chosen = ["winner", "loser", *beside]
    table = {column: data.draw(st.lists(columns[column], min_size=rows, max_size=rows)) for column in chosen}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sources, "BLOCK_ROWS", block)
        agree(pd.DataFrame(table), keep_na=keep_na)


KINDS: dict[str, Any] = {
    "whole numbers": [3, 1, 2, 3],
    "numbers": [3.0, 1.5, -0.25, 1e22],
    "numbers with missing ones": [3.0, None, 2.0, 3.0],
    "truth": [True, False, True, True],
    "days": pd.to_datetime(pd.Series(["2026-01-02", "2026-01-03", None, "2026-01-02"])),
    "times": pd.to_datetime(pd.Series(["2026-01-02 03:04", "2026-01-03 00:00", None, "2026-01-02 00:00"])),
    "intervals": pd.interval_range(0, 4),
    "categories": pd.Categorical(["x", "y", None, "x"], categories=["unused", "y", "x"]),
    "categories of numbers": pd.Categorical([2.0, 1.0, None, 2.0]),
    "categories of whole numbers": pd.Categorical([2, 1, None, 2]),
    "nullable whole numbers": pd.array([3, None, 2, 3], dtype="Int64"),
    "nullable numbers": pd.array([3.5, None, 2.0, 3.5], dtype="Float64"),
    "nullable truth": pd.array([True, None, False, True], dtype="boolean"),
    "texts": pd.array(["x", None, "y", "x"], dtype="string"),
    "objects": pd.Series([1, 1.0, True, None], dtype=object),
    "more objects": pd.Series(["1", 1, 1.5, pd.NA], dtype=object),
    "paths": pd.Series([Path("x"), Path("y"), np.str_("y"), "x"], dtype=object),
    "lists": pd.Series([[1], ["a", 2], None, [1]], dtype=object),
    "nothing": [None, None, None, None],
    "small numbers": np.array([1, 2, 3, 1], dtype=np.float32),
}


@pytest.mark.parametrize("keep_na", [False, True])
@pytest.mark.parametrize("kind", KINDS)
def test_values_of_each_kind_have_the_names_that_csv_gives_them(kind: str, *, keep_na: bool) -> None:
    """As observers and as items."""
    frame = pd.DataFrame({"winner": list("abab"), "loser": list("bcbc"), "observer": KINDS[kind]}).replace({"b": "bee"})
    frame["loser"] = ["c", "d", "c", "d"]
    agree(frame, keep_na=keep_na)
    agree(frame.rename(columns={"winner": "observer", "observer": "winner"}), keep_na=keep_na)


@pytest.mark.parametrize("fault", [("observer", None), ("loser", "a"), ("count", -1.0), ("winner", "")])
def test_the_place_of_a_fault_among_names_of_several_lines_is_that_of_csv(fault: tuple[str, Any]) -> None:
    frame = pd.DataFrame(
        {
            "winner": ["a", "two\nlines", "a\r\nb\rc", "a", "a"],
            "loser": ["b", "c, d", "c", "b", "b"],
            "count": 1.0,
            "observer": ["01", "02", "0\n3", "01", "01"],
        }
    ).astype({"winner": object, "loser": object, "observer": object})
    frame.loc[4, fault[0]] = fault[1]
    _, findings, said = agree(frame)
    assert [finding.line for finding in findings] == ([] if fault[0] == "observer" else [10])
    assert any(f"{FILE}:10:" in each for each in said) == (fault[0] == "observer")


TABLES = {
    "choices": pd.DataFrame({"item_a": list("abca"), "item_b": list("bcab"), "choice": [1, 2, None, 1]}),
    "a wrong choice": pd.DataFrame({"item_a": list("abca"), "item_b": list("bcab"), "choice": [1, 2, 4, 1]}),
    "pwcmp": pd.DataFrame({"condition_A": list("ab"), "condition_B": list("ba"), "is_A_selected": [True, False]}),
    "options": pd.DataFrame({"option_1": ["a", "b"], "option_2": ["b", "c"], "option_3": ["c", None], "choice": "b"}),
    "matrix": pd.DataFrame([[np.nan, 3], [2, np.nan]], index=["a", "b"], columns=["a", "b"]),
    "matrix of numbers": pd.DataFrame([[0, 3], [2, 0]], index=[1, 2], columns=[1, 2]),
    "matrix with a wrong count": pd.DataFrame([[0, -3], [2, 0]], index=["a", "b"], columns=["a", "b"]),
    "observers in the index": pd.DataFrame({"winner": ["a"], "loser": ["b"]}, index=pd.Index([1], name="observer")),
    "no rows": pd.DataFrame({"winner": [], "loser": []}),
    "no columns": pd.DataFrame(),
    "an unknown column": pd.DataFrame({"winner": ["a"], "looser": ["b"]}),
    "a column twice": pd.DataFrame([["a", "b", "c"]], columns=["winner", "loser", "loser"]),
    "columns without names": pd.DataFrame([["a", "b"]]),
    "empty rows": pd.DataFrame({"winner": ["a", "", "b"], "loser": ["b", " ", "a"]}),
    "only missing rows": pd.DataFrame({"winner": ["a", "b"], "loser": [None, "NA"]}),
    "everything missing": pd.DataFrame({"winner": [None, None], "loser": [None, None]}),
}  # fmt: skip


@pytest.mark.parametrize("name", TABLES)
def test_tables_of_each_layout_say_what_their_csv_says(name: str) -> None:
    options: dict[str, Any] = {"choice_codes": ("1", "2")} if "choice" in name else {}
    agree(TABLES[name], **options)
    agree(TABLES[name], keep_na=True, **options)


def test_no_frame_is_written_as_csv(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each distinct value that is no text is written once, and none of the texts."""
    written = []
    real = pd.Series.to_csv

    def counted(self: Any, *arguments: Any, **options: Any) -> Any:
        written.append(len(self))
        return real(self, *arguments, **options)

    monkeypatch.setattr(NDFrame, "to_csv", counted)
    random = np.random.default_rng(1)
    pairs = np.array([random.permutation(4)[:2] for _ in range(3000)])
    texts = np.array(list("abcd"), dtype=object)[pairs]
    frame = pd.DataFrame(texts, columns=["winner", "loser"]).assign(observer=random.integers(0, 9, 3000))
    assert len(notebook.scores(frame).rows) == 4
    assert written == [9]
