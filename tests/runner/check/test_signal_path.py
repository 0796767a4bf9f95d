"""What the system tells of the way from framebuffer to panel: read where it is told, unknown where it is not."""

from __future__ import annotations

import ctypes
import struct
from collections.abc import Callable
from pathlib import Path

import pytest

from runner.check import signal_path
from runner.check.signal_path import (
    bits_per_colour,
    code_range,
    colour_profile,
    dithering,
    night_light,
    output_properties,
    stated_bits,
    tags,
)
from runner.presenter.surfaces.x11 import _x_server, colour_profiles, is_xwayland

# As xrandr prints it; made up.
TOLD = """\
Screen 0: minimum 8 x 8, current 3840 x 1080, maximum 32767 x 32767
HDMI-1 connected primary 1920x1080+0+0 (normal left inverted right x axis y axis) 530mm x 300mm
\tEDID:
\t\t00ffffffffffff00
\tmax bpc: 12
\t\trange: (8, 12)
\tBroadcast RGB: Limited 16:235
\t\tsupported: Automatic, Full, Limited 16:235
   1920x1080     60.00*+
DP-2 connected 1920x1080+1920+0
\tBroadcast RGB: Full
\tdithering mode: off
DP-3 disconnected (normal left inverted right x axis y axis)
\tBroadcast RGB: Automatic
\tmax bpc: 8
"""


def test_properties_are_those_of_connected_outputs() -> None:
    outputs = output_properties(TOLD)
    assert set(outputs) == {"HDMI-1", "DP-2"}
    assert outputs["HDMI-1"]["max bpc"] == "12"
    assert outputs["DP-2"] == {"Broadcast RGB": "Full", "dithering mode": "off"}
    assert output_properties("") == {}


@pytest.mark.parametrize(
    ("value", "doubt", "words"),
    [
        ("Limited 16:235", True, "squeezed into 16..235"),
        ("Automatic", True, "the driver decides"),
        ("tvrgb", True, "squeezed"),
        ("Full", False, "X Full"),
        ("bypass", False, "X bypass"),
    ],
)
def test_limited_range_is_told_from_full(value: str, doubt: bool, words: str) -> None:
    fact = code_range({"X": {"Broadcast RGB": value}}, "")
    assert (fact.doubt, words in fact.words) == (doubt, True)


def test_what_is_not_told_is_unknown() -> None:
    assert code_range({"X": {}}, "the driver does not tell").words == "unknown: the driver does not tell"
    assert bits_per_colour({}, "why", {}).words == "unknown: why"
    assert dithering({}, "why").words == "unknown: why"
    assert not any(fact.doubt for fact in (code_range({}, ""), bits_per_colour({}, "", {}), dithering({}, "")))


@pytest.mark.parametrize(("value", "doubt"), [("off", False), ("auto", True), ("dynamic 2x2", True), ("on", True)])
def test_dithering_is_doubted_unless_it_is_off(value: str, doubt: bool) -> None:
    fact = dithering({"X": {"dithering mode": value}}, "")
    assert (fact.words, fact.doubt) == (f"X {value}", doubt)


def edid(video: int, version: tuple[int, int] = (1, 4)) -> bytes:
    block = bytearray(128)
    block[:8] = b"\x00\xff\xff\xff\xff\xff\xff\x00"
    block[18], block[19], block[20] = *version, video
    return bytes(block)


def screen(drm: Path, connector: str, data: bytes, status: str = "connected") -> None:
    folder = drm / connector
    folder.mkdir(parents=True)
    (folder / "status").write_text(f"{status}\n")
    (folder / "edid").write_bytes(data)


def test_screens_state_their_bits(tmp_path: Path) -> None:
    screen(tmp_path, "card0-eDP-1", edid(0x80 | 1 << 4 | 5))
    screen(tmp_path, "card0-DP-1", edid(0x80 | 3 << 4 | 5))
    screen(tmp_path, "card0-HDMI-A-1", edid(0x80))
    screen(tmp_path, "card0-HDMI-A-2", edid(0x80 | 2 << 4, (1, 3)))
    screen(tmp_path, "card0-VGA-1", edid(0x20))
    screen(tmp_path, "card0-DP-2", edid(0x80 | 2 << 4), "disconnected")
    screen(tmp_path, "card0-DP-3", b"\x00" * 128)
    screen(tmp_path, "card0-DP-4", b"")
    stated = stated_bits(tmp_path)
    assert stated == {"eDP-1": 6, "DP-1": 10, "HDMI-A-1": None, "HDMI-A-2": None, "VGA-1": None}
    fact = bits_per_colour(output_properties(TOLD), "", stated)
    assert fact.doubt
    for words in ("HDMI-1 sends at most 12 bits", "eDP-1 states 6 bits", "HDMI-A-1 does not state", "by dithering"):
        assert words in fact.words
    assert not bits_per_colour({}, "", {"DP-1": 8}).doubt
    assert stated_bits(tmp_path / "nothing") == {}


@pytest.mark.parametrize(("name", "doubt"), [("redshift", True), ("gsd-color", True), ("bash", False)])
def test_programs_that_load_tables_are_named(
    name: str, doubt: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(signal_path, "_said", lambda *command: None)
    (tmp_path / "17").mkdir()
    (tmp_path / "17" / "comm").write_text(f"{name}\n")
    fact = night_light(tmp_path)
    assert fact.doubt == doubt
    assert ("running: " + name in fact.words) == doubt
    assert night_light(tmp_path / "nothing").words == "unknown"


@pytest.mark.parametrize(("told", "doubt"), [("true\n", True), ("false\n", False)])
def test_the_desktops_night_light_is_asked_for(
    told: str, doubt: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(signal_path, "_said", lambda *command: told)
    fact = night_light(tmp_path)
    assert (fact.words, fact.doubt) == (f"night light of the desktop: {'on' if doubt else 'off'}", doubt)


def profile(*signatures: bytes) -> bytes:
    body = b"".join(signature + bytes(8) for signature in signatures)
    return bytes(128) + struct.pack(">I", len(signatures)) + body


def set_profile(data: bytes) -> None:
    """Set the first monitor's profile as a colour manager does; none if there are no bytes."""
    with _x_server() as opened:
        assert opened is not None
        x11, display = opened
        atom = x11.XInternAtom(display, b"_ICC_PROFILE", 0)
        root = x11.XDefaultRootWindow(display)
        x11.XChangeProperty.argtypes = [
            *(ctypes.c_void_p, ctypes.c_ulong, ctypes.c_ulong, ctypes.c_ulong),
            *(ctypes.c_int, ctypes.c_int, ctypes.c_char_p, ctypes.c_int),
        ]
        x11.XDeleteProperty.argtypes = [ctypes.c_void_p, ctypes.c_ulong, ctypes.c_ulong]
        if data:
            x11.XChangeProperty(display, root, atom, 6, 8, 0, data, len(data))  # 6: the type CARDINAL
        else:
            x11.XDeleteProperty(display, root, atom)


@pytest.mark.window
def test_a_profile_that_a_colour_manager_set_is_read(gamma_server: str, load_table: Callable[[float], None]) -> None:
    assert colour_profiles() == ()
    assert colour_profile().words == "none is set"
    try:
        for data, words, doubt in (
            (profile(b"desc", b"vcgt"), "1 set by a colour manager; one of them brings a gamma table", True),
            (profile(b"desc", b"wtpt"), "1 set by a colour manager; none of them brings a gamma table", False),
        ):
            set_profile(data)
            assert colour_profiles() == (data,)
            fact = colour_profile()
            assert (words in fact.words, fact.doubt) == (True, doubt)
    finally:
        set_profile(b"")
    assert not is_xwayland()


def test_a_profile_cut_short_has_the_tags_that_are_there() -> None:
    whole = profile(b"desc", b"vcgt")
    assert tags(whole) == (b"desc", b"vcgt")
    assert tags(whole[:150]) == (b"desc",)
    assert tags(whole[:100]) == ()
    assert tags(bytes(128) + b"\xff" * 4) == ()


def test_without_an_x_server_nothing_is_claimed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    assert colour_profiles() is None
    assert colour_profile().words == "unknown: there is no X server"
