"""What the system tells of what changes codes on their way from the framebuffer to the panel.

Each answer is what a program reports of itself. What is really on the screen, measurements alone can say.
"""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from documents import InputError
from documents.files import read_regular
from runner.presenter.surfaces.screens import compositor
from runner.presenter.surfaces.x11 import colour_profiles, is_xwayland

# Names of the same thing in drivers: i915, amdgpu and nouveau, radeon.
_RANGES = ("Broadcast RGB", "output_csc")
_BITS = ("max bpc",)
_DITHERS = ("dithering mode", "dither", "dithering")
# EDID 1.4, byte 20 of the first block, bits 4 to 6.
_EDID_BITS = {1: 6, 2: 8, 3: 10, 4: 12, 5: 14, 6: 16}
_EDID_START = b"\x00\xff\xff\xff\xff\xff\xff\x00"
# Programs that load gamma tables, as the system names their processes (15 letters at most).
LOADERS = (
    *("redshift", "redshift-gtk", "gammastep", "gammastep-indic", "xflux", "fluxgui", "sct", "xsct", "wlsunset"),
    *("hyprsunset", "dispwin", "xcalib", "gsd-color", "xiccd"),
)
_PATIENCE_S = 10.0
_MOST_BYTES = 100_000  # of a file in which the system states a fact


@dataclass(frozen=True, slots=True)
class SignalFact:
    """A thing that can change codes, and in ``words`` what the system tells of it; ``doubt`` if it may change them."""

    title: str
    words: str
    doubt: bool = False


def examine_signal_path(drm: Path = Path("/sys/class/drm"), processes: Path = Path("/proc")) -> tuple[SignalFact, ...]:
    """Return what the system tells of the way from the framebuffer to the panel, in plain words.

    ``drm`` and ``processes`` are where Linux lists screens and processes.
    """
    outputs, why = _outputs()
    return (
        code_range(outputs, why),
        bits_per_colour(outputs, why, stated_bits(drm)),
        dithering(outputs, why),
        colour_profile(),
        night_light(processes),
        composition(),
    )


def _outputs() -> tuple[Mapping[str, Mapping[str, str]], str]:
    """Return the properties of the connected outputs, or why they are not known."""
    if shutil.which("xrandr") is None:
        return {}, "xrandr is not installed"
    told = _said("xrandr", "--prop")
    if told is None:
        return {}, "xrandr cannot reach an X server"
    if is_xwayland():
        return {}, "Xwayland does not know it"
    return output_properties(told), "the driver does not tell"


def output_properties(told: str) -> dict[str, dict[str, str]]:
    """Return the properties of each connected output in what ``xrandr --prop`` prints."""
    outputs: dict[str, dict[str, str]] = {}
    properties: dict[str, str] | None = None
    for line in told.splitlines():
        if header := re.match(r"(\S+) (connected|disconnected)\b", line):
            properties = outputs.setdefault(header[1], {}) if header[2] == "connected" else None
        elif properties is not None and (found := re.match(r"\t([^\t:]+):\s*(.*?)\s*$", line)):
            properties[found[1]] = found[2]
    return outputs


def code_range(outputs: Mapping[str, Mapping[str, str]], why: str) -> SignalFact:
    """Return whether codes are sent as 0..255 or squeezed into 16..235."""
    found = _property(outputs, _RANGES)
    if not found:
        return SignalFact("range of codes", f"unknown: {why}")
    words, doubt = [], False
    for output, value in found.items():
        limited = value.lower().startswith(("limited", "tvrgb"))
        automatic = value.lower().startswith("auto")
        doubt |= limited or automatic
        more = ": codes are squeezed into 16..235" if limited else ": the driver decides; set it to Full"
        words.append(f"{output} {value}{more if limited or automatic else ''}")
    return SignalFact("range of codes", "; ".join(words), doubt)


def bits_per_colour(outputs: Mapping[str, Mapping[str, str]], why: str, stated: Mapping[str, int | None]) -> SignalFact:
    """Return how many bits the cable may carry, and how many a screen states that it takes."""
    words = [f"{output} sends at most {value} bits" for output, value in _property(outputs, _BITS).items()]
    words += [
        f"the screen at {connector} states {bits} bits" if bits else f"the screen at {connector} does not state any"
        for connector, bits in stated.items()
    ]
    few = [bits for bits in stated.values() if bits is not None and bits < 8]
    if few:
        words.append("a panel of 6 bits makes the others by dithering in time")
    return SignalFact("bits per colour", "; ".join(words) or f"unknown: {why}", bool(few))


def dithering(outputs: Mapping[str, Mapping[str, str]], why: str) -> SignalFact:
    """Return whether the driver dithers."""
    found = _property(outputs, _DITHERS)
    words = "; ".join(f"{output} {value}" for output, value in found.items())
    doubt = any(value.lower() not in ("off", "none", "disabled", "0") for value in found.values())
    return SignalFact("dithering by the driver", words or f"unknown: {why}", doubt)


def stated_bits(drm: Path) -> dict[str, int | None]:
    """Return how many bits a channel each connected screen states (EDID 1.4); None where it states none."""
    stated: dict[str, int | None] = {}
    for connector in sorted(drm.glob("card*-*")):
        try:
            connected = read_regular(connector / "status", _MOST_BYTES).strip() == b"connected"
            edid = read_regular(connector / "edid", _MOST_BYTES) if connected else b""
        except InputError:
            continue
        if len(edid) >= 128 and edid.startswith(_EDID_START):
            name = connector.name.partition("-")[2]
            digital, version = edid[20] & 0x80, (edid[18], edid[19])
            stated[name] = _EDID_BITS.get(edid[20] >> 4 & 7) if digital and version >= (1, 4) else None
    return stated


def colour_profile() -> SignalFact:
    """Return whether a colour manager has set profiles, and whether they bring a gamma table."""
    profiles = colour_profiles()
    if profiles is None:
        return SignalFact("colour profile", "unknown: there is no X server")
    if not profiles:
        return SignalFact("colour profile", "none is set")
    with_table = sum(b"vcgt" in tags(profile) for profile in profiles)
    table = {0: "none of them brings", 1: "one of them brings"}.get(with_table, f"{with_table} of them bring")
    words = f"{len(profiles)} set by a colour manager; {table} a gamma table (vcgt)"
    return SignalFact("colour profile", words, with_table > 0)


def tags(profile: bytes) -> tuple[bytes, ...]:
    """Return the signatures of the tags of an ICC profile; none if it is cut short."""
    count = min(int.from_bytes(profile[128:132], "big"), max(0, (len(profile) - 132) // 12))
    return tuple(profile[132 + 12 * number : 136 + 12 * number] for number in range(count))


def night_light(processes: Path) -> SignalFact:
    """Return whether the desktop's night light is on, and which programs run that load gamma tables."""
    words = []
    on = _said("gsettings", "get", "org.gnome.settings-daemon.plugins.color", "night-light-enabled")
    if on is not None:
        words.append(f"night light of the desktop: {'on' if on.strip() == 'true' else 'off'}")
    running = set()
    for file in processes.glob("[0-9]*/comm"):
        try:
            running.add(read_regular(file, _MOST_BYTES).decode("utf-8", "replace").strip())
        except InputError:
            continue  # it has ended
    loaders = sorted(running & set(LOADERS))
    if loaders:
        words.append(f"running: {', '.join(loaders)}")
    elif running:
        words.append("no program is running that is known to load gamma tables")
    return SignalFact("night light", "; ".join(words) or "unknown", bool(loaders) or (on or "").strip() == "true")


def composition() -> SignalFact:
    """Return which compositor stands between windows and the screen."""
    words = compositor()
    managed = words.startswith("Wayland")
    more = "; it may manage colours, and no program can tell" if managed else ""
    return SignalFact("compositor", f"{words}{more}", managed)


def _property(outputs: Mapping[str, Mapping[str, str]], names: tuple[str, ...]) -> dict[str, str]:
    return {output: properties[name] for output, properties in outputs.items() for name in names if name in properties}


def _said(*command: str) -> str | None:
    """Return what a program prints, None if it is not there or fails."""
    try:
        done = subprocess.run(command, capture_output=True, encoding="utf-8", errors="replace", timeout=_PATIENCE_S)
    except (OSError, subprocess.TimeoutExpired, UnicodeDecodeError):
        return None
    return done.stdout if done.returncode == 0 else None
