"""A small made-up display, row-interleaved, as the tests of measuring write it to a file."""

from __future__ import annotations

from pathlib import Path

DISPLAY = """\
schema_version: 1
panel: {resolution_px: [64, 48], pixel_pitch_mm: 0.25}
modes:
  row-interleaved:
    black_XYZ_cd_m2: [0.02, 0.02, 0.03]
    primaries_XYZ_cd_m2: {red: [10.83, 5.62, 0.54], green: [9.67, 18.65, 1.63], blue: [5.68, 2.20, 29.18]}
    curve: {kind: gog, red: {gamma: 2.1}, green: {gamma: 2.2}, blue: {gamma: 2.3}}
    source: made up for tests
"""

# What a log of measurements begins with, but for its steps.
HEADER: dict[str, object] = {
    **{"begun_utc": "2026-01-02T03:04:05+00:00", "instrument": "none", "mode": "flat", "eye": "left"},
    **{"set": "many", "set_source": "", "seed": 1, "highest_code": 255},
}


RIG = "schema_version: 1\ndisplay: display.yaml\nmode: row-interleaved\ndistance_mm: 700\n"


def write_rig(folder: Path, display: str = DISPLAY) -> Path:
    """Write ``display.yaml`` and ``rig.yaml`` into a folder, and return it."""
    (folder / "display.yaml").write_text(display)
    (folder / "rig.yaml").write_text(RIG)
    return folder
