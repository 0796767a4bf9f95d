"""What proves an instrument: one described by its protocol keeps the promises, and is found by name."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from cyclopean.testing import BrokenPromiseError, prove_instrument
from devices.errors import DeviceError
from devices.readings import (
    INSTRUMENTS,
    GarbledError,
    InstrumentError,
    LostError,
    PatchOnScreen,
    RangeError,
    Wiring,
    open_instrument,
    recorded_name,
)
from documents import InputError

PROTOCOL = r"""
schema_version: 1
name: Acme LM
source: its manual
line: {baud_rate: 9600, end: lf}
fault: '(?P<code>ER\d+).*'
faults: {ER10: {says: too bright, then: range}, ER20: {says: no data, then: again}, ER51: {says: its cooling}}
begin: [{send: RM 1, answer: 'OK,LM(?P<model>\d+),(?P<number>\d+)'}]
read:
  - {send: MEAS, answer: OK, wait: measurement}
  - {send: DATA, answer: 'OK,(?P<X>[^,]*),(?P<Y>[^,]*),(?P<Z>[^,]*)'}
finish: RM 0
"""
ANSWERS = ["OK,LM150,77", "OK", "OK,26.1,26.4,31.3"]
FAULTS: dict[str, type[InstrumentError]] = {
    "ER10": RangeError,
    "ER20": GarbledError,
    "ER51,x": LostError,
    "ER99": GarbledError,
}
LIGHT = (26.1, 26.4, 31.3)


@pytest.fixture
def protocol(tmp_path: Path) -> Path:
    file = tmp_path / "acme.yaml"
    file.write_text(PROTOCOL, encoding="utf-8")
    return file


def test_a_protocol_keeps_the_promises(protocol: Path) -> None:
    assert len(prove_instrument(protocol, ANSWERS, LIGHT, FAULTS)) == 5
    text = PROTOCOL.replace("<X>", "<x>").replace("<Z>", "<Y>", 1).replace("(?P<Y>[^,]*),(?P<Y>", "(?P<y>[^,]*),(?P<Y>")
    protocol.write_text(text + "cd_m2_per_unit: 2", encoding="utf-8")
    assert prove_instrument(protocol, [*ANSWERS[:2], "OK,0.25,0.5,10.0"], (10.0, 20.0, 10.0), FAULTS)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("(?P<X>[^,]*),(?P<Y>[^,]*),(?P<Z>[^,]*)", r"(?P<X>[\d.]*).*,(?P<Y>[\d.]+),(?P<Z>[\d.]+)", "another reading"),
        (r"(?P<code>ER\d+).*", r"(?P<code>ER1\d).*", "what it is"),
        ("ER10: {says: too bright, then: range}", "ER10: {says: too bright}", "what it is"),
        ("<X>[^,]*),(?P<Y>", "<Y>[^,]*),(?P<X>", "the reading"),
    ],
)
def test_a_protocol_that_breaks_a_promise_is_found(protocol: Path, old: str, new: str, said: str) -> None:
    protocol.write_text(PROTOCOL.replace(old, new), encoding="utf-8")
    with pytest.raises(BrokenPromiseError, match=said):
        prove_instrument(protocol, ANSWERS, LIGHT, FAULTS)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("<X>", "<Q>"),
        ("<X>", "<Y>"),
        ("(?P<code>", "("),
        ("<model>", "<X>"),
        ("[{send", "[{sent"),
        ("9600", "1"),
        ("ER\\d+).*", "ER\\d+.*"),
    ],
)
def test_a_wrong_protocol_is_refused_with_its_place(protocol: Path, old: str, new: str) -> None:
    protocol.write_text(PROTOCOL.replace(old, new), encoding="utf-8")
    with pytest.raises(InputError) as refused:
        prove_instrument(protocol, ANSWERS, LIGHT)
    assert refused.value.findings[0].file == str(protocol)
    assert refused.value.findings[0].line


def test_another_packages_instrument_is_opened_by_its_name(
    install: Callable[..., None], play: Callable[..., Any], protocol: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(INSTRUMENTS, "_loaded", {})
    install("acme", "CYCLOPEAN_INTERFACE = 1", "2.1", group=INSTRUMENTS.group, **{"acme-lm": "acme.yaml"})
    install("torn", "CYCLOPEAN_INTERFACE = 1", group=INSTRUMENTS.group, torn="torn.yaml")
    site = protocol.parent / "site"
    (site / "acme.yaml").write_text(PROTOCOL, encoding="utf-8")
    (site / "torn.yaml").write_text(PROTOCOL.replace("<X>", "<Q>"), encoding="utf-8")
    said = {"RM 1": ANSWERS[0], "MEAS": ANSWERS[1], "DATA": ANSWERS[2]}
    line = play({command: f"{answer}\r\n".encode() for command, answer in said.items()}, b"\n")
    opened = open_instrument("acme-lm", Wiring(line.port, {"answer_s": "5"}))
    assert recorded_name("acme-lm", opened) == "Acme LM 150 77 (by acme 2.1)"
    assert opened.read(PatchOnScreen("white", (1.0, 1.0, 1.0), 0)).XYZ_cd_m2 == LIGHT
    opened.close()
    for name, said_of in (("torn", "torn 1.0"), ("acme-lx", "did you mean 'acme-lm'")):
        with pytest.raises((DeviceError, InputError), match=said_of):
            open_instrument(name, Wiring("x"))
