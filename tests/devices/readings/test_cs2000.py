"""The CS-2000 against a transcript on a pseudo-terminal: readings, and every way in which they fail."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

import pytest

from devices.readings import GarbledError, LostError, RangeError, Showing
from devices.readings.cs2000 import CS2000
from devices.readings.instrument import TimedOutError

HANG_UP = b"<the cable is pulled>"
SHOWING = Showing("white", (1.0, 1.0, 1.0), 0)
COLOUR = b"OK00,1.2345e-01,2.6470e+01,2.6180e+01,2.6470e+01,3.1350e+01,0.3117,0.3151,0.2,0.3,6500,0.001\n"


def _block(first: int, count: int) -> bytes:
    return b"OK00," + b",".join(b"%.4e" % (1e-6 * (first + i)) for i in range(count)) + b"\n"


def _answers(**changed: Any) -> dict[str, Any]:
    answers = {
        "RMTS,1": b"OK00\n",
        "IDDR": b"OK00,CS-2000  ,02,12345678\n",
        "MEAS,1": b"OK00,001\nOK00\n",
        "MEDR,1,0,1": _block(0, 100),
        "MEDR,1,0,2": _block(100, 100),
        "MEDR,1,0,3": _block(200, 100),
        "MEDR,1,0,4": _block(300, 101),
        "MEDR,2,0,00": COLOUR,
        "RMTS,0": b"OK00\n",
    }
    return answers | changed


def _open(play: Callable[..., Any], answers: dict[str, Any], answer_s: float = 1.0) -> tuple[CS2000, Any]:
    transcript = play(answers, b"\n")
    return CS2000(transcript.port, answer_s), transcript


def test_a_reading_with_its_spectrum(play: Callable[..., Any]) -> None:
    instrument, transcript = _open(play, _answers())
    assert instrument.name == "Konica Minolta CS-2000A 12345678"
    reading = instrument.read(SHOWING)
    assert reading.XYZ_cd_m2 == (26.18, 26.47, 31.35)
    assert reading.wavelengths_nm == tuple(range(380, 781))
    assert reading.spectrum == tuple(pytest.approx(1e-6 * i, rel=1e-4) for i in range(401))
    instrument.close()
    transcript.close()
    assert transcript.heard == [
        "RMTS,1", "IDDR", "MEAS,1", *(f"MEDR,1,0,{n}" for n in (1, 2, 3, 4)), "MEDR,2,0,00", "RMTS,0",
    ]  # fmt: skip


def test_lines_may_end_in_both_ends(play: Callable[..., Any]) -> None:
    changed = {command: answer.replace(b"\n", b"\r\n") for command, answer in _answers().items()}
    instrument, _ = _open(play, changed)
    assert instrument.read(SHOWING).XYZ_cd_m2 == (26.18, 26.47, 31.35)
    instrument.close()


@pytest.mark.parametrize(
    ("changed", "error", "words"),
    [
        ({"MEAS,1": b"OK00,001\nER10\n"}, RangeError, "ER10: the light is above"),
        ({"MEAS,1": b"ER71\n"}, RangeError, "ER71"),
        ({"MEAS,1": b"OK00,001\nER02\n"}, GarbledError, "ER02: the measurement failed"),
        ({"MEAS,1": b"OK00,001\nER83\n"}, LostError, "ER83: its measuring angle"),
        ({"MEAS,1": b"OK00\n"}, GarbledError, "answers MEAS,1"),
        ({"MEAS,1": b"OK00,soon\n"}, GarbledError, "'soon'"),
        ({"MEAS,1": b"OK00,99999\n"}, GarbledError, "'99999'"),
        ({"MEAS,1": b"\x00\xff\xfe#?\n"}, GarbledError, "answers MEAS,1"),
        ({"MEDR,1,0,3": _block(0, 99)}, GarbledError, "99 numbers in place of 100"),
        ({"MEDR,1,0,2": _block(0, 100).replace(b"e-05", b"e-x5")}, GarbledError, "answers MEDR,1,0,2"),
        ({"MEDR,2,0,00": b"OK00,1,2,3\n"}, GarbledError, "3 numbers in place of 5"),
        ({"MEDR,2,0,00": COLOUR.replace(b"2.6470e+01,3", b"2.9470e+01,3")}, GarbledError, "Lv 26.47 and Y 29.47"),
        ({"MEDR,2,0,00": COLOUR.replace(b"2.6180e+01", b"nan")}, GarbledError, "not finite"),
        ({"MEAS,1": b"OK00,001\n" + HANG_UP}, LostError, "the instrument is gone"),
        ({"MEDR,1,0,2": b"OK00,1.0e-05,1.0" + HANG_UP}, LostError, "the instrument is gone"),
    ],
)
def test_what_goes_wrong_is_told_apart(
    play: Callable[..., Any], changed: dict[str, Any], error: type[Exception], words: str
) -> None:
    instrument, _ = _open(play, _answers(**changed))
    with pytest.raises(error) as caught:
        instrument.read(SHOWING)
    assert words in str(caught.value)
    assert type(caught.value) is error
    instrument.close()


def test_no_answer_in_time(play: Callable[..., Any]) -> None:
    instrument, _ = _open(play, _answers(**{"MEDR,2,0,00": b"OK00,0.12,26"}), answer_s=0.3)
    with pytest.raises(TimedOutError, match=r"within 0\.3 s, only 'OK00,0\.12,26'"):
        instrument.read(SHOWING)
    instrument.close()


def test_after_garbage_the_next_reading_is_whole(play: Callable[..., Any]) -> None:
    changed = {"MEAS,1": [b"OK00,001\nOK00\n"], "MEDR,1,0,1": [b"OK00,junk\nOK00,more\nnot asked\n", _block(0, 100)]}
    instrument, _ = _open(play, _answers(**changed))
    with pytest.raises(GarbledError):
        instrument.read(SHOWING)
    assert instrument.read(SHOWING).XYZ_cd_m2 == (26.18, 26.47, 31.35)
    instrument.close()


def test_something_else_on_the_port_is_refused(play: Callable[..., Any]) -> None:
    with pytest.raises(GarbledError, match="answers RMTS,1 with 'AT OK'"):
        _open(play, {"RMTS,1": b"AT OK\n"})
    with pytest.raises(TimedOutError, match=r"no answer came within 0\.2 s"):
        _open(play, {}, answer_s=0.2)


def test_no_such_port_names_the_ports() -> None:
    with pytest.raises(LostError, match=r"cannot be opened.*ports here") as caught:
        CS2000(os.path.join(os.sep, "dev", "no-such-port"))
    assert "No such file" in str(caught.value)
