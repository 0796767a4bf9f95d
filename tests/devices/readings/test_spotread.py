"""ArgyllCMS's spotread, played by a small program that says what it says."""

from __future__ import annotations

import stat
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from devices.readings import GarbledError, LostError, RangeError, Showing
from devices.readings.instrument import TimedOutError
from devices.readings.spotread import Spotread

SHOWING = Showing("white", (1.0, 1.0, 1.0), 0)
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
    ("said", "error"),
    [
        ("\n\nSpot read failed due to misread (Reading is inconsistent)\n", GarbledError),
        ("\n\nSpot read failed due to misread (Sensor is saturated)\n", RangeError),
        ("\n\nSpot read failed due to communication problem.\n", GarbledError),
    ],
)
def test_a_failed_reading_is_told_and_the_next_is_read(spotread: Make, said: str, error: type[Exception]) -> None:
    instrument = spotread("ready", said, "retry", "ready", "result", "ready")
    with pytest.raises(error) as caught:
        instrument.read(SHOWING)
    assert said.strip() in str(caught.value)
    assert type(caught.value) is error
    assert instrument.read(SHOWING).XYZ_cd_m2 == (1.125, 2.25, 3.5)


def test_a_sensor_in_the_wrong_place_is_told_without_a_key(spotread: Make) -> None:
    said = "\n\nSpot read failed due to the sensor being in the wrong position\n(Sensor not at the display)\n"
    instrument = spotread("ready", said, "ready", "result", "ready")
    with pytest.raises(GarbledError, match="wrong position"):
        instrument.read(SHOWING)
    assert instrument.read(SHOWING).XYZ_cd_m2 == (1.125, 2.25, 3.5)


@pytest.mark.parametrize(
    ("said", "error"),
    [
        ("\n Result is XYZ: nan nan nan, D50 Lab: nan nan nan\n", GarbledError),
        ("\n Result is XYZ: -nan(ind) 0.1 inf, D50 Lab: 1.0 2.0 3.0\n", GarbledError),
        ("\n Result is Y: 12.3, L*: 4.5\n", GarbledError),
        ("\nNo refresh detectable, or measurement failed\n", GarbledError),
        ("\nThe sensor is saturated\n", RangeError),
        ("\n", GarbledError),
    ],
)
def test_a_prompt_without_a_result_is_a_failed_reading_at_once(
    spotread: Make, said: str, error: type[Exception]
) -> None:
    instrument = spotread("ready", said, "ready", "result", "ready", measure_s=60.0)
    began_s = time.monotonic()
    with pytest.raises(error) as caught:
        instrument.read(SHOWING)
    assert time.monotonic() - began_s < 30.0
    assert type(caught.value) is error
    assert said.strip() in str(caught.value)
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
