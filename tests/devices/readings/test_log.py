"""A measurement on disk: whole lines, one writer, and every damage told with its line."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.errors import MeasuringError
from devices.readings import (
    MeasurementLog,
    Reading,
    find_patches,
    read_csv,
    read_session,
    step_facts,
    steps,
    write_measurements,
)
from devices.readings.read import measurements_of
from tests.kept import known

STEPS = steps(find_patches("grey"), 1)
HEADER = {
    "begun_utc": "2026-01-01T00:00:00+00:00", "instrument": "an instrument", "mode": "flat", "eye": "both",
    "set": "grey", "set_source": "greys", "seed": 1, "highest_code": 255, "steps": step_facts(STEPS),
}  # fmt: skip


def _write(file: Path, count: int = 5) -> None:
    with MeasurementLog.create(file, HEADER) as log:
        for step in STEPS[:count]:
            log.keep(step, 10.0 * step.position, Reading((1.0 + step.position, 2.0, 3.0)))


def test_what_was_kept_is_read(tmp_path: Path) -> None:
    file = tmp_path / "m.jsonl"
    _write(file)
    session = read_session(file)
    assert session.steps == STEPS
    assert {place: kept.reading.XYZ_cd_m2[0] for place, kept in session.readings.items()} == {
        place: 1.0 + place for place in range(5)
    }
    assert [step.position for step in session.missing] == list(range(5, len(STEPS)))
    assert session.header["instrument"] == "an instrument"


@settings(max_examples=12, deadline=None)
@given(st.integers(1, 10_000))
def test_a_line_cut_anywhere_loses_that_line_alone(tmp_path_factory: pytest.TempPathFactory, cut: int) -> None:
    file = tmp_path_factory.mktemp("cut") / "m.jsonl"
    _write(file)
    whole = file.read_bytes()
    first = whole.index(b"\n") + 1
    kept_bytes = first + cut % (len(whole) - first)
    os.truncate(file, kept_bytes)
    # A last line of which only the end is missing is whole.
    lines = whole[: kept_bytes + 1].count(b"\n") - 1
    log, session = MeasurementLog.reopen(file)
    with log:
        assert len(session.readings) == lines
        for step in session.missing[:2]:
            log.keep(step, 99.0, Reading((7.0, 7.0, 7.0)))
    assert len(read_session(file).readings) == lines + 2


def test_a_later_reading_counts_and_undoes_a_failure(tmp_path: Path) -> None:
    file = tmp_path / "m.jsonl"
    _write(file, 2)
    log, _ = MeasurementLog.reopen(file)
    with log:
        log.fail(STEPS[2], 30.0, "too bright")
        log.fail(STEPS[3], 40.0, "too dark")
        log.keep(STEPS[0], 50.0, Reading((9.0, 9.0, 9.0)))
        log.keep(STEPS[2], 60.0, Reading((8.0, 8.0, 8.0)))
    session = read_session(file)
    assert session.readings[0].reading.XYZ_cd_m2 == (9.0, 9.0, 9.0)
    assert session.failures == {3: "too dark"}
    assert 3 not in session.readings


def test_spectra_come_back_with_their_wavelengths(tmp_path: Path) -> None:
    file = tmp_path / "m.jsonl"
    with MeasurementLog.create(file, HEADER) as log:
        for step in STEPS[:3]:
            log.keep(step, 0.0, Reading((1.0, 2.0, 3.0), (0.1, 0.2 + step.position, 0.3), (380.0, 384.0, 388.0)))
    table = measurements_of(read_session(file))
    np.testing.assert_array_equal(known(table.wavelengths_nm), [380.0, 384.0, 388.0])
    np.testing.assert_array_equal(known(table.spectra)[:, 1], [0.2, 1.2, 2.2])
    assert file.read_text().count('"wavelengths"') == 1


def test_the_table_is_read_back_as_it_was_measured(tmp_path: Path) -> None:
    _write(tmp_path / "m.jsonl", len(STEPS))
    session = read_session(tmp_path / "m.jsonl")
    write_measurements(session, tmp_path / "m.csv")
    table, ours = read_csv(tmp_path / "m.csv"), measurements_of(session)
    np.testing.assert_allclose(table.codes, ours.codes, atol=1e-15)
    np.testing.assert_array_equal(table.XYZ, ours.XYZ)
    assert table.name == ours.name
    assert table.assumptions == ()
    assert [table.name.count(name) for name in ("black", "white")] == [4, 4]
    assert list(tmp_path.glob(".*.part")) == []


def test_one_writer_at_a_time(tmp_path: Path) -> None:
    with (
        MeasurementLog.create(tmp_path / "m.jsonl", HEADER),
        pytest.raises(MeasuringError, match="another process"),
    ):
        MeasurementLog.reopen(tmp_path / "m.jsonl")
    MeasurementLog.reopen(tmp_path / "m.jsonl")[0].close()


def test_a_measurement_is_never_overwritten(tmp_path: Path) -> None:
    _write(tmp_path / "m.jsonl")
    before = (tmp_path / "m.jsonl").read_bytes()
    with pytest.raises(MeasuringError, match="exists already"):
        MeasurementLog.create(tmp_path / "m.jsonl", HEADER)
    assert (tmp_path / "m.jsonl").read_bytes() == before


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("{]", "m.jsonl:3:1: the line is damaged"),
        ('{"record":"reading","position":1,"label":"grey","time_s":0,"XYZ_cd_m2":[1,2,3]}', "step 1 is 'white'"),
        ('{"record":"reading","position":99,"label":"white","time_s":0,"XYZ_cd_m2":[1,2,3]}', "no step 99"),
        ('{"record":"reading","position":1,"label":"white","time_s":0,"XYZ_cd_m2":[1,2]}', "m.jsonl:3"),
        ('{"record":"reading","position":1,"label":"white","time_s":0,"XYZ_cd_m2":[1,2,NaN]}', "not finite"),
        (
            '{"record":"reading","position":1,"label":"white","time_s":0,"XYZ_cd_m2":[1,2,3],"spectrum":[1]}',
            "1 spectral",
        ),
        ("[]", "m.jsonl:3"),
    ],
)
def test_a_damaged_line_is_named(tmp_path: Path, line: str, words: str, unchained: Callable[[Path], None]) -> None:
    file = tmp_path / "m.jsonl"
    _write(file, 3)
    unchained(file)
    lines = file.read_text().splitlines()
    lines[2] = line
    file.write_text("\n".join(lines) + "\n")
    with pytest.raises(MeasuringError) as caught:
        read_session(file)
    assert words in str(caught.value)


@pytest.mark.parametrize("text", ["", "{}\n", '{"record":"header","format":"other","version":1}\n', "name,red\n"])
def test_another_file_is_no_measurement(tmp_path: Path, text: str) -> None:
    (tmp_path / "m.jsonl").write_text(text)
    with pytest.raises(MeasuringError, match="this is no measurement"):
        read_session(tmp_path / "m.jsonl")


def test_every_line_is_synced_before_the_next(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    synced: list[int] = []
    fsync = os.fsync

    def counting(descriptor: int) -> None:
        synced.append(os.fstat(descriptor).st_size)
        fsync(descriptor)

    file = tmp_path / "m.jsonl"
    _write(file, 1)
    log, _ = MeasurementLog.reopen(file)
    monkeypatch.setattr(os, "fsync", counting)
    with log:
        for step in STEPS[1:4]:
            log.keep(step, 0.0, Reading((1.0, 2.0, 3.0)))
            assert synced[-1] == file.stat().st_size
    assert len(synced) == 3


def test_a_full_disk_is_said_and_leaves_no_half_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "m.jsonl"
    _write(file, 2)
    log, _ = MeasurementLog.reopen(file)

    def full(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    with log:
        monkeypatch.setattr(os, "fsync", full)
        with pytest.raises(MeasuringError, match=r"the disk of the folder .* is full"):
            log.keep(STEPS[2], 0.0, Reading((1.0, 1.0, 1.0)))
    session = read_session(file)
    assert len(session.readings) == 2
    assert session.torn_tail == b""
    json.loads(file.read_text().splitlines()[-1])


def test_what_was_torn_off_is_kept(tmp_path: Path) -> None:
    file = tmp_path / "m.jsonl"
    _write(file, 2)
    with open(file, "ab") as stream:
        stream.write(b'{"record":"rea')
    MeasurementLog.reopen(file)[0].close()
    (kept,) = tmp_path.glob("m.jsonl.torn-*.bin")
    assert kept.read_bytes() == b'{"record":"rea'
