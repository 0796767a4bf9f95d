"""`display measure` with a serial instrument whose cable is pulled mid-run, and plugged in again."""

from __future__ import annotations

import os
import select
import threading
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from click.testing import CliRunner

from devices.readings import read_session
from runner.cli.main import group

BLOCKS = [b"OK00," + b",".join([b"1.0e-05"] * count) + b"\n" for count in (100, 100, 100, 101)]


@contextmanager
def _plugged(measurements: int) -> Iterator[str]:
    """Play a CS-2000 whose cable is pulled within the measurement after so many; yield its port."""
    try:
        master, slave = os.openpty()
    except OSError as error:
        pytest.skip(f"this machine gives no pseudo-terminals (is /dev/pts mounted?): {error}")
    tty.setraw(slave)
    pulled, over = threading.Event(), threading.Event()

    def answer(command: str, done: int) -> bytes | None:
        if command == "MEAS,1":
            return None if done > measurements else b"OK00,000\nOK00\n"
        if command.startswith("MEDR,1"):
            return BLOCKS[int(command[-1]) - 1]
        if command.startswith("MEDR,2"):
            return b"OK00,1.0e-02,%.4e,1.0e+00,%.4e,3.0e+00\n" % (done, done)
        return b"OK00,CS-2000,01,1234\n" if command == "IDDR" else b"OK00\n"

    def play() -> None:
        waiting, done = b"", 0
        while not over.is_set():
            if not select.select([master], [], [], 0.02)[0]:
                continue
            waiting += os.read(master, 4096)
            *commands, waiting = waiting.split(b"\n")
            for command in commands:
                done += command == b"MEAS,1"
                answered = answer(command.decode(), done)
                if answered is None:
                    os.close(master)
                    os.close(slave)
                    pulled.set()
                    return
                os.write(master, answered)

    thread = threading.Thread(target=play, daemon=True)
    thread.start()
    try:
        yield os.ttyname(slave)
    finally:
        over.set()
        thread.join(5)
        if not pulled.is_set():
            os.close(master)
            os.close(slave)


@pytest.mark.usefixtures("egl")
def test_a_cable_pulled_mid_run_loses_no_reading(tmp_path: Path) -> None:
    (tmp_path / "display.yaml").write_text(
        "schema_version: 1\npanel: {resolution_px: [64, 48], pixel_pitch_mm: 0.25}\n"
    )
    file = tmp_path / "m.jsonl"
    display = str(tmp_path / "display.yaml")
    arguments = ["display", "measure", display, "--mode", "side-by-side", "-o", str(file), "--set", "grey",
                 "--instrument", "cs2000", "--backend", "egl", "--settle", "0",
                 "--accept-readings"]  # fmt: skip
    with _plugged(7) as port:
        result = CliRunner().invoke(group, [*arguments, "--port", port])
    assert result.exit_code == 1
    assert "the instrument is gone" in str(result.exception)
    assert "7 readings are safe" in str(result.exception)
    assert len(read_session(file).readings) == 7
    with _plugged(1000) as port:
        result = CliRunner().invoke(group, [*arguments, "--port", port, "--resume"])
    assert result.exit_code == 0, result.output
    session = read_session(file)
    assert not session.missing
    # The far end counts its own measurements in Y: every one was kept once, in order.
    assert [kept.reading.XYZ_cd_m2[1] for kept in session.readings.values()] == [*range(1, 8), *range(1, 33)]
    assert session.header["instrument"] == "Konica Minolta CS-2000 1234"
