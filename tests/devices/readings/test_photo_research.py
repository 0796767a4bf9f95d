"""The PR-655 against a transcript on a pseudo-terminal: readings, and every way in which they fail."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from devices.readings import GarbledError, LostError, RangeError, Showing
from devices.readings.instrument import TimedOutError
from devices.readings.photo_research import PhotoResearch

HANG_UP = b"<the cable is pulled>"
SHOWING = Showing("white", (1.0, 1.0, 1.0), 0)
POINTS = b"".join(b"%d,%.3e\r\n" % (nm, nm * 1e-6) for nm in range(380, 784, 4))
HEADER = b"00000,1,1.234e-01,0.0,0.0\r\n"


def _answers(**changed: Any) -> dict[str, Any]:
    answers = {
        "PHOTO": b" REMOTE MODE\r\n",
        "SU1": b"00000\r\n",
        "D111": b"00000,PR-655\r\n",
        "D110": b"00000,60123456\r\n",
        "D120": b"00000,101,8.0,380,780,4,256,0,255\r\n",
        "M0": b"00000\r\n",
        "D2": b"00000,1,2.618e+01,2.647e+01,3.135e+01\r\n",
        "D5": HEADER + POINTS,
    }
    return answers | changed


def _open(play: Callable[..., Any], answers: dict[str, Any], answer_s: float = 1.0) -> tuple[PhotoResearch, Any]:
    transcript = play(answers, b"\r")
    return PhotoResearch(transcript.port, answer_s, measure_s=1.0), transcript


@pytest.mark.parametrize("header", [HEADER, HEADER + b"1.234e-01\r\n"], ids=["one line", "two lines"])
def test_a_reading_with_its_spectrum(play: Callable[..., Any], header: bytes) -> None:
    instrument, transcript = _open(play, _answers(D5=header + POINTS))
    assert instrument.name == "Photo Research PR-655 60123456"
    reading = instrument.read(SHOWING)
    assert reading.XYZ_cd_m2 == (26.18, 26.47, 31.35)
    assert reading.wavelengths_nm == tuple(range(380, 784, 4))
    assert reading.spectrum[0] == pytest.approx(380e-6)
    instrument.close()
    transcript.close()
    assert transcript.heard == ["PHOTO", "SU1", "D111", "D110", "D120", "M0", "D2", "D5", "Q"]


@pytest.mark.parametrize(
    ("changed", "error", "words"),
    [
        ({"M0": b"-0002\r\n"}, RangeError, "-2: the light is too bright"),
        ({"M0": b"-0008\r\n"}, RangeError, "-8: the light is too weak"),
        ({"M0": b"-1000\r\n"}, LostError, "-1000: it does not know the command"),
        ({"M0": b"what?\r\n"}, GarbledError, "answers M0 with 'what?'"),
        ({"D2": b"00000,0,2.6e+01,2.6e+01,3.1e+01\r\n"}, LostError, "set it to metric units"),
        ({"D2": b"00000,1,2.6e+01,2.6e+01\r\n"}, GarbledError, "answers D2"),
        ({"D2": b"00000,1,a,b,c\r\n"}, GarbledError, "answers D2"),
        ({"D5": HEADER + POINTS.replace(b"400,", b"40?,")}, GarbledError, "answers D5 with '40?,"),
        ({"D5": HEADER + POINTS.replace(b"400,", b"390,")}, GarbledError, "out of order"),
        ({"M0": HANG_UP}, LostError, "the instrument is gone"),
        ({"D5": HEADER + POINTS[:100] + HANG_UP}, LostError, "the instrument is gone"),
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


def test_a_spectrum_cut_short_times_out(play: Callable[..., Any]) -> None:
    instrument, _ = _open(play, _answers(D5=HEADER + POINTS[:100]), answer_s=0.3)
    with pytest.raises(TimedOutError, match="no answer came within"):
        instrument.read(SHOWING)
    instrument.close()


def test_something_else_on_the_port_is_refused(play: Callable[..., Any]) -> None:
    with pytest.raises(GarbledError, match="answers PHOTO with 'OK00'"):
        _open(play, {"PHOTO": b"OK00\r\n"})
    with pytest.raises(GarbledError, match="answers D120"):
        _open(play, _answers(D120=b"00000,7,8\r\n"))
