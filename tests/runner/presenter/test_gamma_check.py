"""A gamma table against the one that was measured with, and a watch on changes: found, and not found where none is."""

from __future__ import annotations

import numpy as np
import pytest

from devices.display import EYES, NO_TABLE, Eye, GammaTable
from runner.presenter import LoadedTable
from runner.presenter.gamma_check import GammaWatch, compare_tables, table_of_record, tables_json

UNKNOWN = GammaTable.unreadable("nobody looked")


def power(exponent: float, size: int = 256) -> GammaTable:
    return GammaTable.from_shares(np.linspace(0, 1, size) ** exponent)


def on(table: GammaTable, right: GammaTable | None = None, monitor: str = "DP-1") -> dict[Eye, LoadedTable]:
    return {"left": LoadedTable(monitor, table), "right": LoadedTable(monitor, right or table)}


def measured(table: GammaTable, right: GammaTable | None = None) -> dict[Eye, GammaTable]:
    return {"left": table, "right": right or table}


@pytest.mark.parametrize(
    ("before", "now"),
    [(power(1), power(1)), (power(1), power(1, 1024)), (power(1.2), power(1.2)), (power(1.2), power(1.2, 4096))],
)
def test_the_same_table_is_let_pass_without_a_word(before: GammaTable, now: GammaTable) -> None:
    verdict = compare_tables(measured(before), on(now))
    assert (verdict.refusal, verdict.warning) == ("", "")


@pytest.mark.parametrize("now", [power(1), power(1, 1024), power(1.2)])
def test_a_nominal_display_was_measured_with_no_table(now: GammaTable) -> None:
    """The identity is what it is taken for; another table changes codes, and the session may go on."""
    never = GammaTable.unreadable(NO_TABLE)
    verdict = compare_tables(measured(never), on(now))
    assert not verdict.refusal
    assert ("it changes codes" in verdict.warning) == (not now.is_identity)


@pytest.mark.parametrize(
    ("before", "now"), [(power(1), power(1.02)), (power(1.2), power(1)), (power(1.2), power(1.22, 1024))]
)
def test_another_table_is_refused_with_both_named(before: GammaTable, now: GammaTable) -> None:
    refusal = compare_tables(measured(before), on(now)).refusal
    assert "'DP-1' is not the one that the display was measured with" in refusal
    assert f"it is {now.sentence()}; measured with {before.sentence()}" in refusal
    assert now.difference_from(before) in refusal
    assert refusal.count("DP-1") == 1  # said once for both eyes


def test_two_tables_that_are_as_far_from_the_identity_are_told_apart() -> None:
    """Each is off by up to 255 codes, in another channel: what is said is the difference of the two."""
    ramp = np.linspace(0.0, 1.0, 256)
    shares = np.stack([ramp, ramp, ramp], axis=1)
    before, now = (GammaTable.from_shares(np.where(turned, 1 - shares, shares)) for turned in ([0, 1, 1], [1, 0, 1]))
    assert before.sentence() == now.sentence()
    apart = now.difference_from(before)
    assert apart == "it differs by up to 255.00 codes of 8 bits, most at code 0 of red"
    small = GammaTable.from_shares(np.clip(shares + np.array([0.0, 0.0, 0.1]) * (ramp == ramp[128])[:, None], 0, 1))
    assert small.difference_from(GammaTable.identity()).endswith("25.50 codes of 8 bits, most at code 128 of blue")
    watch = GammaWatch(iter([on(before), on(now)]).__next__)
    assert apart in watch.change(now=True)


def test_each_eye_has_its_own() -> None:
    assert compare_tables(measured(power(1), power(1.2)), on(power(1), power(1.2))).refusal == ""
    assert compare_tables(measured(power(1), power(1.2)), on(power(1.2), power(1))).refusal.count("DP-1") == 2


def test_what_is_unknown_is_a_warning_and_nothing_without_a_monitor() -> None:
    for before, now, why in (
        (UNKNOWN, power(1), "is not known: nobody looked"),
        (power(1), UNKNOWN, "cannot be read: nobody looked"),
        (UNKNOWN, UNKNOWN, "cannot be read: nobody looked"),
    ):
        verdict = compare_tables(measured(before), on(now))
        assert verdict.refusal == ""
        assert why in verdict.warning
        nobody = compare_tables(measured(before), on(now, monitor=""))
        assert (nobody.refusal, nobody.warning) == ("", "")


def test_records_keep_each_eyes_table() -> None:
    for tables in (on(power(1.2)), on(power(1.2), power(1))):
        held = tables_json(tables)
        assert set(held) == ({"both"} if tables["left"].table is tables["right"].table else {"left", "right"})
        assert all(table_of_record(held, eye).same_as(tables[eye].table) for eye in EYES)


class Monitor:
    def __init__(self) -> None:
        self.tables = on(power(1.2))
        self.time_s = 0.0
        self.asked = 0

    def read(self) -> dict[Eye, LoadedTable]:
        self.asked += 1
        return self.tables


def test_a_watch_finds_each_change_once_and_none_where_none_is() -> None:
    monitor = Monitor()
    watch = GammaWatch(monitor.read, 1.0, lambda: monitor.time_s)
    for second in range(1, 6):
        monitor.time_s = float(second)
        assert watch.change() == ""
    monitor.tables = on(power(1.2), power(1.3))
    monitor.time_s += 1.0
    assert "changed: it was not the identity" in watch.change()
    monitor.time_s += 1.0
    assert watch.change() == ""
    monitor.tables = on(UNKNOWN)
    monitor.time_s += 1.0
    assert "and is unknown (nobody looked)" in watch.change()
    assert watch.reads == monitor.asked == 9


def test_a_watch_reads_no_more_often_than_it_should() -> None:
    monitor = Monitor()
    watch = GammaWatch(monitor.read, 1.0, lambda: monitor.time_s)
    monitor.tables = on(power(1))
    monitor.time_s = 0.9
    assert watch.change() == ""
    assert monitor.asked == 1
    assert watch.change(now=True)
    assert monitor.asked == 2


def test_without_a_monitor_nothing_is_read_again() -> None:
    monitor = Monitor()
    monitor.tables = on(UNKNOWN, monitor="")
    watch = GammaWatch(monitor.read, 0.0)
    assert [watch.change(now=True) for _ in range(3)] == ["", "", ""]
    assert monitor.asked == 1
