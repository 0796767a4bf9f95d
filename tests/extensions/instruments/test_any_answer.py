"""Whatever an instrument answers, a driver gives a finite reading or one of its errors; never anything else."""

from __future__ import annotations

import math
from collections import deque
from typing import ClassVar

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cyclopean.testing import prove_instrument
from devices.readings import Instrument, InstrumentError, PatchOnScreen, TimedOutError
from extensions.instruments import CS2000, PhotoResearch, cs2000, photo_research

SHOWING = PatchOnScreen("white", (1.0, 1.0, 1.0), 0)
FIELD = st.one_of(
    st.sampled_from(["OK00", "ER10", "ER99", "00000", "-0008", "1", "1e999", "nan", "-inf", "", "CS-2000", "0x1"]),
    st.floats().map(repr),
    st.integers(-2000, 2000).map(str),
    st.text(max_size=8),
)
LINE = st.lists(FIELD, max_size=6).map(",".join)


class _Line:
    """Gives lines in the order told, whatever is sent."""

    port = "a port"
    lines: ClassVar[deque[str]] = deque()

    def __init__(self, *_: object, **__: object) -> None:
        pass

    def send(self, command: str) -> None:
        pass

    def line(self, within_s: float) -> str:
        if not self.lines:
            raise TimedOutError("no more")
        return self.lines.popleft()

    def close(self) -> None:
        pass


@pytest.fixture(autouse=True)
def told_lines(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cs2000, "SerialLine", _Line)
    monkeypatch.setattr(photo_research, "SerialLine", _Line)


Driver = type[CS2000] | type[PhotoResearch]
BLOCKS = [",".join(["OK00"] + ["1e-5"] * count) for count in (100, 100, 100, 101)]
WHOLE = {
    CS2000: [
        "OK00", "OK00,CS-2000,01,1", "OK00,001", "OK00", *BLOCKS, "OK00,1,26.4,26.1,26.4,31.3,0.3,0.3",
    ],
    PhotoResearch: [
        " REMOTE MODE", "00000", "00000,PR-655", "00000,1", "00000,101,8,380,780,4", "00000", "00000,1,26.1,26.4,31.3",
        "00000,1,1e-1,0,0", *(f"{nm},1e-5" for nm in range(380, 784, 4)),
    ],
}  # fmt: skip


def _read(kind: Driver) -> None:
    try:
        instrument: Instrument = kind("a port")
        reading = instrument.read(SHOWING)
    except InstrumentError:
        return
    assert all(map(math.isfinite, (*reading.XYZ_cd_m2, *reading.spectrum)))
    assert len(reading.spectrum) == len(reading.wavelengths_nm) >= 31


@pytest.mark.parametrize("kind", list(WHOLE))
@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(place=st.integers(0, 120), changed=st.lists(LINE, max_size=3), cut=st.booleans())
def test_any_change_to_the_transcript(kind: Driver, place: int, changed: list[str], cut: bool) -> None:
    lines = WHOLE[kind]
    place %= len(lines)
    _Line.lines = deque([*lines[:place], *changed, *([] if cut else lines[place + 1 :])])
    _read(kind)


@pytest.mark.parametrize("kind", list(WHOLE))
@settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(lines=st.lists(LINE, max_size=30))
def test_nothing_but_junk(kind: Driver, lines: list[str]) -> None:
    _Line.lines = deque(lines)
    _read(kind)


@pytest.mark.parametrize("kind", list(WHOLE))
def test_ours_keep_the_promises(kind: Driver) -> None:
    assert prove_instrument(lambda line: kind("a port", line=line), WHOLE[kind], (26.1, 26.4, 31.3))
