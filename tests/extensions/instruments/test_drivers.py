"""Instruments of ours on pseudo-terminals and as programs: readings, and every way in which they fail."""

from __future__ import annotations

import os
import re
import stat
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from devices.errors import DeviceError
from devices.readings import (
    GarbledError,
    LostError,
    PatchOnScreen,
    RangeError,
    TimedOutError,
    Wiring,
    open_instrument,
    spectral_instruments,
)
from extensions.instruments import CS2000, PhotoResearch, Spotread

# ArgyllCMS's spotread, played by a small program that says what it says.

SHOWING = PatchOnScreen("white", (1.0, 1.0, 1.0), 0)
PLAYED = """\
#!{python}
import os, sys
def say(text):
    sys.stdout.write(text); sys.stdout.flush()
def key():
    line = sys.stdin.readline()
    if not line or line.startswith("q"):
        sys.exit(0)
READY = ("\\nPlace instrument on spot to be measured,\\nand hit [A-Z] to read white and setup FWA compensation\\n"
         "Hit ESC or Q to exit, instrument switch or any other key to take a reading: ")
CALIBRATE = ("\\nSpot read needs a calibration before continuing\\nPlace cap on the instrument,\\n"
             " and then hit any key to continue,\\n or hit Esc or Q to abort: ")
assert os.environ["ARGYLL_NOT_INTERACTIVE"] and sys.argv[1] == "-e", sys.argv
script = {script!r}
n = 0
for act in script:
    if act == "ready":
        say(READY); key()
    elif act == "calibrate":
        say(CALIBRATE); key(); say("\\nCalibration complete\\n")
    elif act == "stored":
        say("\\nThere are saved spot readings in the instrument.\\n")
        say("Hit ESC or Q to exit, N to not read saved reading,\\nany other key to use reading: ")
        assert sys.stdin.readline().strip() == "N"
    elif act == "retry":
        say("Hit Esc or Q to give up, any other key to retry:"); key(); say("\\n")
    elif act == "result":
        n += 1
        say("\\n Result is XYZ: %d.125000 %d.250000 %d.500000, D50 Lab: 1.0 2.0 3.0\\n" % (n, 2 * n, 3 * n))
    elif act == "hang":
        key()
    else:
        say(act)
"""
Make = Callable[..., Spotread]


@pytest.fixture
def spotread(tmp_path: Path) -> Iterator[Make]:
    opened: list[Spotread] = []

    def make(*script: str, ask: Callable[[str], str | None] = lambda prompt: None, measure_s: float = 5.0) -> Spotread:
        program = tmp_path / "spotread"
        program.write_text(PLAYED.format(python=sys.executable, script=list(script)))
        program.chmod(program.stat().st_mode | stat.S_IXUSR)
        instrument = Spotread("2", ["-yl"], ask, start_s=10.0, measure_s=measure_s, program=str(program))
        opened.append(instrument)
        return instrument

    yield make
    for instrument in opened:
        instrument.close()


def test_it_is_opened_by_name_with_the_program_s_own_options(
    spotread: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    spotread("ready")  # which writes the program
    monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
    instrument = open_instrument("spotread", Wiring("2", {"spotread": "-yl -X 'a panel.ccss'"}))
    assert instrument.name == "ArgyllCMS spotread -e -c 2 -yl -X a panel.ccss"
    instrument.close()
    with pytest.raises(DeviceError, match="no option 'speed'"):
        open_instrument("spotread", Wiring("2", {"speed": "1"}))


def test_those_with_spectra_are_known_by_name() -> None:
    assert spectral_instruments() == ("cs2000", "pr655")


def test_readings_one_after_the_other(spotread: Make) -> None:
    instrument = spotread("ready", "result", "ready", "result", "ready")
    assert instrument.name == "ArgyllCMS spotread -e -c 2 -yl"
    assert instrument.read(SHOWING).XYZ_cd_m2 == (1.125, 2.25, 3.5)
    assert instrument.read(SHOWING).XYZ_cd_m2 == (2.125, 4.25, 6.5)


def test_a_person_calibrates_at_the_start_and_between(spotread: Make) -> None:
    asked: list[str] = []

    def ask(prompt: str) -> str:
        asked.append(prompt)
        return ""

    instrument = spotread("calibrate", "ready", "result", "ready", "calibrate", "ready", "result", "ready", ask=ask)
    assert instrument.read(SHOWING).XYZ_cd_m2[0] == 1.125
    assert instrument.read(SHOWING).XYZ_cd_m2[0] == 2.125
    assert len(asked) == 2
    assert "Place cap on the instrument" in asked[0]


def test_with_nobody_there_a_calibration_is_an_error(spotread: Make) -> None:
    with pytest.raises(LostError, match=r"waits for a hand.*calibration"):
        spotread("calibrate", "ready")


@pytest.mark.parametrize(
    ("said", "then", "error"),
    [
        ("\n\nSpot read failed due to misread (Reading is inconsistent)\n", ["retry"], GarbledError),
        ("\n\nSpot read failed due to misread (Sensor is saturated)\n", ["retry"], RangeError),
        ("\n\nSpot read failed due to communication problem.\n", ["retry"], GarbledError),
        (
            "\n\nSpot read failed due to the sensor being in the wrong position\n(Sensor not at the display)\n",
            [],
            GarbledError,
        ),
        ("\n Result is XYZ: nan nan nan, D50 Lab: nan nan nan\n", [], GarbledError),
        ("\n Result is XYZ: -nan(ind) 0.1 inf, D50 Lab: 1.0 2.0 3.0\n", [], GarbledError),
        ("\n Result is Y: 12.3, L*: 4.5\n", [], GarbledError),
        ("\nNo refresh detectable, or measurement failed\n", [], GarbledError),
        ("\nThe sensor is saturated\n", [], RangeError),
        ("\n", [], GarbledError),
    ],
)
def test_a_failed_reading_is_told_at_once_and_the_next_is_read(
    spotread: Make, said: str, then: list[str], error: type[Exception]
) -> None:
    """Without a result or a key that is asked for, the next prompt tells that there is none."""
    instrument = spotread("ready", said, *then, "ready", "result", "ready", measure_s=60.0)
    began_s = time.monotonic()
    with pytest.raises(error) as caught:
        instrument.read(SHOWING)
    assert time.monotonic() - began_s < 30.0
    assert type(caught.value) is error
    assert " ".join(said.split()) in str(caught.value)
    assert instrument.read(SHOWING).XYZ_cd_m2 == (1.125, 2.25, 3.5)


def test_a_calibration_that_fails_is_a_persons_to_mend(spotread: Make) -> None:
    failed = (
        "Calibration failed with 'Measurement misread' (No refresh rate)\nHit any key to retry, or Esc or Q to abort:"
    )
    asked: list[str] = []

    def ask(prompt: str) -> str:
        asked.append(prompt)
        return ""

    instrument = spotread("ready", failed, "hang", "ready", "result", "ready", ask=ask, measure_s=60.0)
    assert instrument.read(SHOWING).XYZ_cd_m2 == (1.125, 2.25, 3.5)
    assert len(asked) == 1
    assert "No refresh rate" in asked[0]
    with pytest.raises(LostError, match="No refresh rate"):
        spotread(failed, "hang", "ready")


def test_readings_that_the_instrument_stored_are_not_taken(spotread: Make) -> None:
    instrument = spotread("stored", "ready", "result", "ready")
    assert instrument.read(SHOWING).XYZ_cd_m2 == (1.125, 2.25, 3.5)


def test_a_calibration_that_a_reading_needs_comes_before_it(spotread: Make) -> None:
    said = "\n\nSpot read failed because instruments needs calibration.\n"
    instrument = spotread("ready", said, "calibrate", "ready", "result", "ready", ask=lambda prompt: "")
    assert instrument.read(SHOWING).XYZ_cd_m2 == (1.125, 2.25, 3.5)


def test_a_program_that_ends_is_lost(spotread: Make) -> None:
    instrument = spotread("ready", "result", "ready", "\nInstrument was unplugged\n")
    instrument.read(SHOWING)
    with pytest.raises(LostError, match="ended: Instrument was unplugged"):
        instrument.read(SHOWING)


def test_a_program_that_hangs_times_out(spotread: Make) -> None:
    instrument = spotread("ready", "hang", measure_s=0.4)
    with pytest.raises(TimedOutError, match="did not answer in time"):
        instrument.read(SHOWING)


def test_without_the_program_the_remedy_is_told(tmp_path: Path) -> None:
    with pytest.raises(LostError, match="install ArgyllCMS"):
        Spotread(None, [], lambda prompt: None, program=str(tmp_path / "no-spotread"))


# The CS-2000 against a transcript on a pseudo-terminal: readings, and every way in which they fail.

HANG_UP = b"<the cable is pulled>"

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
    with pytest.raises(error, match=re.escape(words)) as caught:
        instrument.read(SHOWING)
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


# The PR-655 against a transcript on a pseudo-terminal: readings, and every way in which they fail.

POINTS = b"".join(b"%d,%.3e\r\n" % (nm, nm * 1e-6) for nm in range(380, 784, 4))
HEADER = b"00000,1,1.234e-01,0.0,0.0\r\n"


def _pr_answers(**changed: Any) -> dict[str, Any]:
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


def _pr_open(play: Callable[..., Any], answers: dict[str, Any], answer_s: float = 1.0) -> tuple[PhotoResearch, Any]:
    transcript = play(answers, b"\r")
    return PhotoResearch(transcript.port, answer_s, measure_s=1.0), transcript


@pytest.mark.parametrize("header", [HEADER, HEADER + b"1.234e-01\r\n"], ids=["one line", "two lines"])
def test_pr_a_reading_with_its_spectrum(play: Callable[..., Any], header: bytes) -> None:
    instrument, transcript = _pr_open(play, _pr_answers(D5=header + POINTS))
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
def test_pr_what_goes_wrong_is_told_apart(
    play: Callable[..., Any], changed: dict[str, Any], error: type[Exception], words: str
) -> None:
    instrument, _ = _pr_open(play, _pr_answers(**changed))
    with pytest.raises(error) as caught:
        instrument.read(SHOWING)
    assert words in str(caught.value)
    assert type(caught.value) is error
    instrument.close()


def test_a_spectrum_cut_short_times_out(play: Callable[..., Any]) -> None:
    instrument, _ = _pr_open(play, _pr_answers(D5=HEADER + POINTS[:100]), answer_s=0.3)
    with pytest.raises(TimedOutError, match="no answer came within"):
        instrument.read(SHOWING)
    instrument.close()


def test_pr_something_else_on_the_port_is_refused(play: Callable[..., Any]) -> None:
    with pytest.raises(GarbledError, match="answers PHOTO with 'OK00'"):
        _pr_open(play, {"PHOTO": b"OK00\r\n"})
    with pytest.raises(GarbledError, match="answers D120"):
        _pr_open(play, _pr_answers(D120=b"00000,7,8\r\n"))
