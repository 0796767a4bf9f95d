"""Marks on real ports: pseudo-terminals and streams that come back, and one clear message for each fault."""

from __future__ import annotations

import errno
import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from importlib.util import find_spec
from typing import Any

import pytest
from serial import SerialException

from documents.platform import open_parallel_port, pseudo_terminal
from extensions.marks import LslMarksSpec, MarkError, ParallelMarksSpec, PortLostError, SerialMarksSpec
from extensions.marks import parallel_port as parallel_module
from tests.kept import known

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="there are no pseudo-terminals")
needs_lsl = pytest.mark.skipif(find_spec("pylsl") is None, reason="pylsl is not installed (pip install '.[lsl]')")


@pytest.fixture
def terminal() -> Iterator[tuple[str, Any]]:
    """A pseudo-terminal's name, and what reads what is sent there."""
    with pseudo_terminal() as pair:
        yield known(pair)


def serial(port: str, **more: Any) -> SerialMarksSpec:
    return SerialMarksSpec(kind="serial", port=port, **more)


def read_all(read: Callable[[float], bytes], count: int) -> bytes:
    got = b""
    until_s = time.monotonic() + 20
    while len(got) < count and time.monotonic() < until_s:
        got += read(0.5)
    return got + read(0.05)


def test_a_serial_mark_is_its_byte_and_every_value_goes_through(terminal: Any) -> None:
    name, read = terminal
    with closing(serial(name).open_port()) as port:
        for code in range(1, 256):
            port.send(code, time.monotonic())
        assert read_all(read, 255) == bytes(range(1, 256))


def test_a_pulse_ends_in_0_and_a_mark_within_it_begins_a_new_one(terminal: Any) -> None:
    name, read = terminal
    with closing(serial(name, pulse_ms=100).open_port()) as port:
        port.send(7, 0.0)
        port.send(9, 0.0)
        sent_s = time.monotonic()
        assert read_all(read, 3) == bytes([7, 9, 0])
        assert time.monotonic() - sent_s >= 0.1
        port.send(5, 0.0)
    assert read_all(read, 2) == bytes([5, 0])  # closing ends it at once


def test_a_port_that_is_not_there_is_named_with_those_that_are() -> None:
    with pytest.raises(MarkError) as refused:
        serial("/dev/no_such_port").open_port()
    (fault,) = refused.value.findings
    assert (fault.file, fault.message) == ("/dev/no_such_port", "there is no such serial port")
    assert known(fault.remedy).startswith("ports here: ")


def test_a_port_in_use_is_one_message(terminal: Any) -> None:
    name, _ = terminal
    with closing(serial(name).open_port()), pytest.raises(MarkError, match="in use by another program") as refused:
        serial(name).open_port()
    assert refused.value.findings[0].remedy == "close that program"


def test_a_file_is_no_serial_port(tmp_path: Any) -> None:
    file = tmp_path / "file"
    file.write_text("")
    with pytest.raises(MarkError, match="the serial port cannot be opened"):
        serial(str(file)).open_port()
    assert file.read_text() == ""


SERIAL_REFUSALS = {
    (None, "port 'COM4': PermissionError(13, 'Access is denied.', None, 5)"): "in use by another program",
    (None, "could not open port 'COM4': FileNotFoundError(2, 'The system cannot find it.', None, 2)"): "no such serial",
    (errno.EACCES, "could not open port /dev/ttyUSB0: Permission denied"): "this user may not open the serial port",
    (errno.EBUSY, "could not open port /dev/ttyUSB0: Device or resource busy"): "in use by another program",
    (errno.EIO, "could not open port /dev/ttyS0: Input/output error"): "cannot be opened: could not open port",
}


@pytest.mark.parametrize(("number", "words"), SERIAL_REFUSALS)
def test_each_refusal_of_a_serial_port_is_explained(
    number: int | None, words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What pyserial raises under Linux, and in its own words under Windows."""

    def refuse(*_: object, **__: object) -> None:
        raise SerialException(number, words) if number else SerialException(words)

    monkeypatch.setattr("extensions.marks.serial_port.serial.Serial", refuse)
    with pytest.raises(MarkError, match=SERIAL_REFUSALS[number, words]) as refused:
        serial("/dev/ttyUSB0").open_port()
    assert refused.value.findings[0].remedy


def test_a_port_that_nobody_reads_never_blocks_and_works_again(terminal: Any) -> None:
    name, read = terminal
    with closing(serial(name).open_port()) as port:
        refused = None
        longest_s, sent = 0.0, 0
        while refused is None and sent < 200_000:
            began_s = time.thread_time()
            try:
                port.send(1 + sent % 255, 0.0)
                sent += 1
            except MarkError as error:
                refused = error
            longest_s = max(longest_s, time.thread_time() - began_s)
        assert not isinstance(known(refused), PortLostError)
        assert "takes no more bytes" in str(known(refused))
        assert longest_s < 0.1  # of this thread's own time: a write that spins would take all of it
        got = read_all(read, sent)
        assert got == bytes(1 + number % 255 for number in range(sent))
        port.send(3, 0.0)
        assert read_all(read, 1) == b"\x03"


def test_a_port_that_goes_away_is_lost() -> None:
    with pseudo_terminal() as pair:
        port = serial(known(pair)[0]).open_port()
    with pytest.raises(PortLostError, match="the port is gone"):
        port.send(1, 0.0)
    port.close()


def test_a_serial_loopback_comes_back() -> None:
    with serial("/dev/never_opened").loopback() as loopback:
        assert loopback is not None
        loopback.port.send(1, 0.0)
        assert loopback.receive(5.0)
        assert not loopback.receive(0.01)


@needs_lsl
def test_a_stream_carries_words_and_the_time_of_the_event() -> None:
    import pylsl

    spec = LslMarksSpec(kind="lsl", stream=f"test {os.getpid()}")
    with spec.loopback() as loopback:
        assert loopback is not None
        (info,) = pylsl.resolve_byprop("name", spec.stream, 1, 10.0)
        assert (info.type(), info.channel_format(), info.nominal_srate()) == ("Markers", pylsl.cf_string, 0.0)
        inlet = pylsl.StreamInlet(info)
        inlet.open_stream(10.0)
        while inlet.pull_sample(0.2)[0] is None:
            loopback.port.send("begin", time.monotonic())
        while inlet.pull_sample(0.3)[0] is not None:
            pass
        ahead_s = pylsl.local_clock() - time.monotonic()
        onset_s = time.monotonic() - 0.25  # the mark is late, its time is that of the event
        assert loopback.port.is_heard
        loopback.port.send("onset", onset_s)
        loopback.port.send("answer ä", onset_s + 0.2)
        got = [inlet.pull_sample(10.0) for _ in range(2)]
        assert [words for (words,), _ in got] == ["onset", "answer ä"]
        for (_, stamp_s), event_s in zip(got, (onset_s, onset_s + 0.2), strict=True):
            assert stamp_s == pytest.approx(event_s + ahead_s, abs=0.005)  # both clocks are read one after the other
        inlet.close_stream()


@needs_lsl
def test_a_stream_knows_whether_it_is_received() -> None:
    with closing(LslMarksSpec(kind="lsl", stream=f"unheard {os.getpid()}").open_port()) as port:
        assert not port.is_heard
        port.send("onset", time.monotonic())


def test_a_trial_byte_follows_its_code(terminal: Any) -> None:
    name, read = terminal
    for more, ends in (({}, b""), ({"pulse_ms": 1000}, b"\x00")):
        with closing(serial(name, **more).open_port()) as port:
            port.send(7, 0.0, 0)
            port.send(9, 0.0, 255)
        assert read_all(read, 4 + len(ends)) == bytes([7, 0, 9, 255]) + ends


def test_a_missing_package_says_what_to_type(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pylsl", None)
    with pytest.raises(MarkError) as refused:
        LslMarksSpec(kind="lsl").open_port()
    (fault,) = refused.value.findings
    assert "the package pylsl" in fault.message
    assert fault.remedy == "pip install '.[lsl]'"


def test_a_missing_library_says_where_it_is(monkeypatch: pytest.MonkeyPatch, tmp_path: Any) -> None:
    monkeypatch.delitem(sys.modules, "pylsl", raising=False)
    (tmp_path / "pylsl.py").write_text("raise RuntimeError('LSL binary library file was not found.')\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(MarkError, match="liblsl is not") as refused:
        LslMarksSpec(kind="lsl").open_port()
    assert "PYLSL_LIB" in str(refused.value)


@pytest.mark.skipif(sys.platform != "linux", reason="the kernel's own parallel ports")
def test_parallel_ports_that_cannot_be_had() -> None:
    with pytest.raises(MarkError, match="there is no such parallel port") as refused:
        ParallelMarksSpec(kind="parallel", port="/dev/parport77").open_port()
    assert "modprobe" in str(refused.value)
    with pytest.raises(MarkError, match="this is no parallel port"):
        ParallelMarksSpec(kind="parallel", port="/dev/null").open_port()
    with ParallelMarksSpec(kind="parallel").loopback() as loopback:
        assert loopback is None


REFUSALS = {
    errno.EACCES: "this user may not open the parallel port",
    errno.EBUSY: "the parallel port is in use",
    errno.ENXIO: "the parallel port is in use",
    errno.ENOTSUP: "parallel ports can be used on Linux only",
}


@pytest.mark.parametrize("number", REFUSALS)
def test_each_refusal_of_a_parallel_port_is_explained(number: int, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(port: str) -> int:
        raise OSError(number, os.strerror(number), port)

    monkeypatch.setattr(parallel_module, "open_parallel_port", refuse)
    with pytest.raises(MarkError, match=REFUSALS[number]) as refused:
        ParallelMarksSpec(kind="parallel").open_port()
    assert refused.value.findings[0].remedy


@pytest.mark.skipif(sys.platform != "linux", reason="the kernel's own parallel ports")
def test_what_a_parallel_port_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    """No such port is here: the requests are those of Linux's ppdev.h, with /dev/null in place of the port."""
    import fcntl

    asked: list[tuple[int, int | None]] = []

    def ioctl(descriptor: int, request: int, value: bytes | None = None) -> int:
        asked.append((request, None if value is None else value[0]))
        return 0

    monkeypatch.setattr(fcntl, "ioctl", ioctl)
    port = ParallelMarksSpec(kind="parallel", port="/dev/null", pulse_ms=20).open_port()
    port.send(129, 0.0)
    until_s = time.monotonic() + 20
    while len(asked) < 5 and time.monotonic() < until_s:
        time.sleep(0.005)
    port.send(2, 0.0)
    port.close()
    claim, release, exclusive, write_data = (ord("p") << 8 | number for number in (0x8B, 0x8C, 0x8F, 0x86))
    write_data |= 1 << 30 | 1 << 16  # it hands over one byte
    pins = [(write_data, value) for value in (0, 129, 0, 2, 0)]
    assert asked == [(exclusive, None), (claim, None), *pins, (release, None)]


@pytest.mark.skipif(sys.platform != "linux", reason="the kernel's own parallel ports")
def test_a_parallel_port_that_is_refused_is_closed_again(monkeypatch: pytest.MonkeyPatch) -> None:
    before = len(os.listdir("/proc/self/fd"))
    with pytest.raises(OSError, match="Inappropriate ioctl"):
        open_parallel_port("/dev/null")
    assert len(os.listdir("/proc/self/fd")) == before
