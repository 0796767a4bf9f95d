"""Promises as values, the page that gathers them, and what has fallen since the last release."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from benchmarks import history
from benchmarks.history import Promise
from benchmarks.promises import times_as_fast
from benchmarks.run_all import Ran, broken, named, page
from benchmarks.run_all import main as run_all


def test_a_figure_beyond_its_limit_is_not_kept() -> None:
    for direction, kept in (("at most", 1.0), ("at least", 3.0), ("exactly", 2.0)):
        good = Promise("a", kept, 2.0, "error", direction)
        assert good.state() == "kept"
        assert Promise("a", 2.0, 2.0, "error", direction).kept
    assert Promise("a", 2.1, 2.0, "error").state() == "NOT KEPT"
    assert Promise("a", 1.9, 2.0, "ratio", "at least").state() == "NOT KEPT"
    assert Promise("a", 3, 2, "count", "exactly").state() == "NOT KEPT"
    assert Promise("a", math.nan, 2.0, "error").state() == "NOT KEPT"
    assert Promise("a", math.nan, 2.0, "ratio", "at least").state() == "NOT KEPT"


def test_a_peer_that_is_not_installed_is_said_and_counts_as_neither() -> None:
    promise = Promise("beside evalica", None, 10.0, "ratio", "at least", missing="evalica is not installed")
    assert promise.kept is None
    assert promise.state() == "not measured"
    assert "evalica is not installed" in page([Ran("bradley_terry", 1.0, (promise,))], [], "here", quick=False)
    with pytest.raises(ValueError, match="say either a figure or"):
        Promise("beside evalica", None, 10.0, "ratio", "at least")


def test_times_are_compared_where_both_have_the_parameter_and_the_least_counts() -> None:
    rows = [
        {"series": series, "parameter": parameter, "seconds": time}
        for series, parameter, time in (("ours", "a", 1.0), ("peer", "a", 4.0), ("ours", "b", 2.0), ("peer", "b", 6.0))
    ]
    assert times_as_fast([*rows, {"series": "ours", "parameter": "c", "seconds": 9.0}], "ours", "peer") == 3.0
    with pytest.raises(LookupError, match="did a name change"):
        times_as_fast(rows, "ours", "another")


def test_absolute_times_decide_nothing_and_a_quick_run_judges_what_is_exact() -> None:
    assert Promise("a", 9.0, 2.0, "seconds").state() == "followed"
    assert Promise("a", 9.0, 2.0, "seconds").promised() == "goal: 2"
    for kind in ("ratio", "share"):
        assert Promise("a", 9.0, 2.0, kind).state(quick=True) == "not judged"
    for kind in ("count", "error"):
        assert Promise("a", 9.0, 2.0, kind).state(quick=True) == "NOT KEPT"


def test_the_page_names_what_is_not_kept_and_what_failed() -> None:
    ran = [
        Ran("one", 2.0, (Promise("error", 3.0, 2.0, "error"), Promise("uploads", 15, 15, "count", "exactly"))),
        Ran("two", 1.0, failed="Traceback: no such file"),
    ]
    assert len(broken(ran, [], quick=False)) == 2
    text = page(ran, [("one: ratio", "1, more than a quarter worse")], "here", quick=False)
    assert "| one | error | 3 | at most 2 | NOT KEPT |" in text
    assert "| one | uploads | 15 | exactly 15 | kept |" in text
    assert "no such file" in text
    assert "- **one: ratio: 1, more than a quarter worse**" in text
    assert "Every promise that was judged is kept" in page([Ran("one", 1.0)], [], "here", quick=False)


@pytest.mark.parametrize(
    ("direction", "now", "has_fallen"),
    [("at least", 7.6, False), ("at least", 7.4, True), ("at most", 13.2, False), ("at most", 13.4, True)],
)
def test_a_ratio_may_fall_by_a_quarter(direction: history.Direction, now: float, has_fallen: bool) -> None:
    last = history.Release("1", "2026-01-01", "here", {"one: a": 10.0})
    promises = {"one: a": Promise("a", now, None, "ratio", direction)}
    assert bool(list(history.fallen(promises, last, machine="here"))) == has_fallen
    assert not list(history.fallen(promises, last, machine="elsewhere"))


def test_counts_are_equal_to_those_of_the_last_release_on_every_machine() -> None:
    last = history.Release("1", "2026-01-01", "here", {"one: a": 15}, {"one: a": 3})
    assert not list(history.fallen({"one: a": Promise("a", 15, None, "count")}, last))
    assert list(history.fallen({"one: a": Promise("a", 14, None, "count")}, last))
    assert not list(history.fallen({"one: a": Promise("a", 3, None, "count")}, last, quick=True))
    assert list(history.fallen({"one: a": Promise("a", 15, None, "count")}, last, quick=True))


def test_what_is_measured_no_more_is_named() -> None:
    last = history.Release("1", "2026-01-01", "here", {"one: a": 15, "two: b": 1})
    other = {"one: c": Promise("c", 15, None, "count")}
    assert [name for name, _ in history.fallen(other, last)] == ["one: a"]
    peerless = {"one: a": Promise("a", None, 1.0, "ratio", missing="not installed")}
    assert not list(history.fallen(peerless, last))


def test_a_line_is_added_for_each_version(tmp_path: Path) -> None:
    file = tmp_path / "history.jsonl"
    ran = [Ran("one", 1.0, (Promise("a", 1 / 3, 1.0, "ratio"), Promise("b", 4, 4, "count", "exactly")))]
    for version in ("1", "2", "2"):
        history.append(history.release(version, "here", named(ran), named(ran)), file)
    found = history.releases(file)
    assert [line.version for line in found] == ["1", "2"]
    assert found[-1].figures == {"one: a": 0.333333, "one: b": 4}
    assert found[-1].quick == {"one: b": 4}
    assert history.releases(tmp_path / "none") == []


def test_single_scripts_are_added_to_the_line_of_their_version(tmp_path: Path) -> None:
    file = tmp_path / "history.jsonl"
    history.append(history.Release("1", "2026-01-01", "here", {"one: a": 1, "one: b": 2, "two: c": 3}), file)
    history.append(history.Release("1", "2026-01-02", "here", {"one: a": 4}, {"one: a": 5}), file, whole=False)
    (found,) = history.releases(file)
    assert (found.date, found.figures, found.quick) == ("2026-01-02", {"two: c": 3, "one: a": 4}, {"one: a": 5})
    history.append(history.Release("1", "2026-01-03", "elsewhere", {"one: a": 6}), file, whole=False)
    assert history.releases(file)[0].figures == {"one: a": 6}
    history.append(history.Release("1", "2026-01-04", "elsewhere", {"two: c": 7}), file)
    assert history.releases(file)[0].figures == {"two: c": 7}


def test_a_name_that_is_no_benchmark_is_refused(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["run_all.py", "colour_pas"])
    with pytest.raises(SystemExit) as ended:
        run_all()
    assert ended.value.code == 2
    assert "no such benchmark: colour_pas" in capsys.readouterr().err


@pytest.mark.parametrize(("figure", "status"), [(1.0, 0), (3.0, 1)])
def test_the_exit_status_says_whether_all_is_kept(
    figure: float, status: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    ran = Ran("startup", 1.0, (Promise("error", figure, 2.0, "error"),))
    monkeypatch.setattr("benchmarks.run_all.run", lambda script, quick: ran)
    monkeypatch.setattr("benchmarks.run_all.OUT", tmp_path)
    monkeypatch.setattr("benchmarks.run_all.where", lambda: "here")
    monkeypatch.setattr("benchmarks.run_all.history.releases", list)
    monkeypatch.setattr("sys.argv", ["run_all.py", "startup"])
    assert run_all() == status
    page_written = (tmp_path / "promises.md").read_text(encoding="utf-8")
    assert page_written in capsys.readouterr().out
    said = json.loads((tmp_path / "promises.json").read_text(encoding="utf-8"))
    assert (said["wrong"] == []) == (status == 0)
