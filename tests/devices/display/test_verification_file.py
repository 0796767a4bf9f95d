"""Records of a photodiode's verification: read, refused with the place, and held against a session."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

import pytest

from devices.display import Verification, read_rig, read_verification
from devices.errors import DeviceError
from documents import InputError

ROOT = Path(__file__).parents[3]
RECORD = """\
schema_version: 1
date: 2026-03-14
instrument: photodiode and oscilloscope
mode: side-by-side
refresh_hz: 120
display_server: X11
renderer: A card
onsets: 200
onset_error_ms: {mean: 4.3, standard_deviation: 0.2, worst: 5.1}
left_onset_error_ms: {mean: 4.2, standard_deviation: 0.2, worst: -4.9}
"""


def _write(folder: Path, old: str = "", new: str = "") -> Path:
    assert old in RECORD
    (folder / "photodiode.yaml").write_text(RECORD.replace(old, new))
    return folder / "photodiode.yaml"


def _read(folder: Path, old: str = "", new: str = "") -> Verification:
    return read_verification(_write(folder, old, new))


def test_a_record_is_read_with_the_digest_of_its_file(tmp_path: Path) -> None:
    found = _read(tmp_path)
    assert found.sha256 == hashlib.sha256(RECORD.encode()).hexdigest()
    assert found.to_json()["date"] == "2026-03-14"
    assert found.to_json()["onset_error_ms"]["worst"] == 5.1
    assert found.eye_error_ms("left").worst == -4.9
    assert found.eye_error_ms("right").worst == 5.1
    assert "in 200 onsets light came 4.3 ms after" in found.sentence()


def test_the_example_in_the_docs_is_one(tmp_path: Path) -> None:
    (text,) = re.findall(
        r"```yaml\n(# configs/rigs/photodiode.yaml.*?)```", (ROOT / "docs/timing.md").read_text(), re.S
    )
    (tmp_path / "record.yaml").write_text(text)
    assert read_verification(tmp_path / "record.yaml").spec.mode == "quad-buffered"


WRONG = [
    ("onsets: 200", "onsets: 1", 8, "'onsets' is 1"),
    ("refresh_hz: 120", "refresh_hz: 0", 5, "'refresh_hz' is 0"),
    ("worst: 5.1", "worst: 4.2", 9, "cannot be nearer to it than 'mean'"),
    ("standard_deviation: 0.2, worst: 5.1", "standard_deviation: -0.2, worst: 5.1", 9, "standard_deviation' is -0.2"),
    ("2026-03-14", "14 March", 2, "a day such as 2026-03-14"),
    ("2026-03-14", "20260314", 2, "a day such as 2026-03-14"),
    ("instrument:", "instruments:", 3, "did you mean 'instrument'"),
    ("onsets: 200\n", "", 1, "'onsets' is missing"),
]


@pytest.mark.parametrize(("old", "new", "line", "said"), WRONG)
def test_a_wrong_record_is_refused_with_its_place(tmp_path: Path, old: str, new: str, line: int, said: str) -> None:
    with pytest.raises(InputError) as caught:
        _read(tmp_path, old, new)
    told = {finding.line: str(finding) for finding in caught.value.findings}
    assert said in told[line]


def test_it_holds_for_what_was_measured_and_for_nothing_else(tmp_path: Path) -> None:
    found = _read(tmp_path)
    assert found.mismatches(mode="side-by-side", refresh_hz=119.88, display_server="X11", renderer="A card") == ()
    assert found.mismatches(mode="side-by-side") == ()
    assert found.mismatches(mode="flat") == ("measured in the mode 'side-by-side', not 'flat'",)
    assert found.mismatches(mode="side-by-side", refresh_hz=60.0) == ("measured at 120 Hz, not 60 Hz",)
    assert found.mismatches(mode="side-by-side", refresh_hz=float("inf")) == ("measured at 120 Hz, not inf Hz",)
    server, renderer = found.mismatches(mode="side-by-side", display_server="Wayland", renderer="llvmpipe")
    assert server.endswith("'X11', not 'Wayland'")
    assert renderer.endswith("'A card', not 'llvmpipe'")
    silent = _read(tmp_path, "renderer: A card\n", "")
    assert silent.mismatches(mode="side-by-side", display_server="X11", renderer="llvmpipe") == ()


def _rig(folder: Path, more: str, display: str = str(ROOT / "configs/displays/asus_vg248qe.yaml")) -> Path:
    rig = folder / "rig.yaml"
    rig.write_text(f"schema_version: 1\ndisplay: {display}\nmode: side-by-side\ndistance_mm: 700\n{more}")
    return rig


def test_a_rig_reads_the_record_that_it_names(tmp_path: Path) -> None:
    assert read_rig(_rig(tmp_path, "")).photodiode_verification is None
    (tmp_path / "records").mkdir()
    record = _write(tmp_path / "records")
    named = read_rig(_rig(tmp_path, "photodiode_verification: records/photodiode.yaml\n")).photodiode_verification
    assert named == read_verification(record)


def test_a_rig_tells_what_is_wrong_with_all_that_it_names(tmp_path: Path) -> None:
    with pytest.raises(DeviceError, match=r"rig.yaml:5:26: there is no such record"):
        read_rig(_rig(tmp_path, "photodiode_verification: photodiode.yaml\n"))
    _write(tmp_path, "onsets: 200", "onsets: none")
    with pytest.raises(DeviceError) as caught:
        read_rig(_rig(tmp_path, "photodiode_verification: photodiode.yaml\n", "none.yaml"))
    display, record = map(str, caught.value.findings)
    assert "rig.yaml:2:10: " in display
    assert "photodiode.yaml:8:9: 'onsets' is 'none'" in record
    with pytest.raises(InputError, match="'photodiode_verification' is empty"):
        read_rig(_rig(tmp_path, "photodiode_verification: ''\n"))
