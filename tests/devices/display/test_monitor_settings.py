"""The monitor's settings: stated, compared, carried from the rig through readings into the display file.

Records of a photodiode's verification: read, refused with the place, and held against a session.
"""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

import numpy as np
import pytest

from devices.characterise import fit_display, table_c1_codes, thesis_display
from devices.diagnostics import judge_display
from devices.display import MonitorSettings, PanelSpec, Verification, read_display, read_rig, read_verification
from devices.errors import DeviceError
from devices.readings import Measurements, read_measurements, write_csv
from devices.readings.table import joined
from devices.readings.ti3 import format_ti3, parse_ti3
from documents import InputError

SETTINGS = MonitorSettings.model_validate(
    {
        "preset": "Standard",
        "brightness_percent": 35,
        "gains_percent": {"red": 96, "green": 94, "blue": 88},
        "colour_temperature": 6500,
        "overdrive": "TraceFree 60",
        "lightboost": 10,
        "dynamic_contrast": False,
        "other": {"Smart View": False, "Eye Care": 2},
    }
)
DISPLAY = Path("configs/displays/asus_vg248qe.yaml")
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


def _readings(settings: str = SETTINGS.to_text()) -> Measurements:
    codes = table_c1_codes()[np.union1d(np.arange(0, 120, 4), [26, 52, 78, 119])]
    return Measurements(codes, thesis_display().xyz(codes), mode="quad-buffered", monitor_settings=settings)


def test_only_what_both_state_is_compared() -> None:
    other = MonitorSettings.model_validate(
        {"brightness_percent": 40, "contrast_percent": 80, "other": {"Eye Care": 3, "Smart View": False}}
    )
    assert SETTINGS.differences(other) == ("brightness_percent 35, not 40", "other.Eye Care 2, not 3")
    assert SETTINGS.differences(SETTINGS) == SETTINGS.differences(MonitorSettings()) == ()
    assert "gains_percent.red 96" in SETTINGS.words
    assert "dynamic_contrast off" in SETTINGS.words


@pytest.mark.parametrize("settings", [SETTINGS, MonitorSettings(), MonitorSettings(input_range="limited")])
def test_text_and_back(settings: MonitorSettings) -> None:
    assert MonitorSettings.parse(settings.to_text()) == settings


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("{", "the monitor's settings are wrong"),
        ('{"brightness_percent": 101}', "brightness_percent' is 101 .*write a number from 0 to 100"),
        ('{"brightnes_percent": 50}', "brightnes_percent"),
        ('{"dynamic_contrast": "maybe"}', "dynamic_contrast"),
    ],
)
def test_wrong_settings_are_refused_with_file_and_key(text: str, says: str) -> None:
    with pytest.raises(DeviceError, match=f"^a.csv: .*{says}"):
        MonitorSettings.parse(text, "a.csv")


def test_what_changes_light_by_itself_is_said() -> None:
    settings = MonitorSettings(dynamic_contrast=True, local_dimming=True, automatic_brightness=True)
    assert [words.partition(" is on")[0] for words in settings.doubts] == [
        "dynamic contrast",
        "local dimming",
        "automatic brightness",
    ]
    assert MonitorSettings(input_range="limited").doubts
    assert SETTINGS.doubts == ()


def test_tables_keep_them(tmp_path: Path) -> None:
    table = _readings()
    write_csv(table, tmp_path / "a.csv")
    assert read_measurements(tmp_path / "a.csv").monitor_settings == table.monitor_settings
    assert parse_ti3(format_ti3(table).splitlines(), "a.ti3").monitor_settings == table.monitor_settings
    assert joined([table, table]).monitor_settings == table.monitor_settings
    assert joined([table, _readings("")]).monitor_settings == ""


@pytest.mark.nightly
@pytest.mark.usefixtures("fits_kept")
def test_a_fit_writes_them_into_the_mode_and_the_report_compares(tmp_path: Path) -> None:
    file, table = tmp_path / "d.yaml", tmp_path / "a.csv"
    fit_display(_readings(), model="gog").write(file, PanelSpec.parse("1920x1080,0.2768"))
    assert read_display(file).monitor_settings["quad-buffered"] == SETTINGS
    write_csv(_readings(MonitorSettings(brightness_percent=50, dynamic_contrast=True).to_text()), table)
    notes = " ".join(judge_display([table], display=file).notes)
    assert "was set to brightness_percent 50" in notes
    assert "otherwise: brightness_percent 50, not 35" in notes
    assert "dynamic contrast is on" in notes
    with pytest.raises(DeviceError, match="holds settings of the monitor and"):
        fit_display(read_measurements(table), model="gog").write(file)
    fit_display(read_measurements(table), model="gog").write(file, replace=True)
    assert read_display(file).monitor_settings["quad-buffered"].brightness_percent == 50


def test_the_shipped_display_has_the_thesis_s_table_3_2() -> None:
    settings = read_display(DISPLAY).monitor_settings["side-by-side"]
    assert settings.stated == {
        "preset": "Standard",
        "brightness_percent": 35,
        "contrast_percent": 80,
        "gains_percent.red": 96,
        "gains_percent.green": 94,
        "gains_percent.blue": 88,
    }


def test_a_rig_used_with_other_settings_is_doubted(tmp_path: Path) -> None:
    file = tmp_path / "rig.yaml"
    text = f"schema_version: 1\ndisplay: {DISPLAY.resolve()}\nmode: side-by-side\ndistance_mm: 700\n"
    file.write_text(text)
    assert read_rig(file).settings_doubts == ()
    file.write_text(text + "monitor_settings: {brightness_percent: 60, contrast_percent: 80, dynamic_contrast: true}\n")
    dynamic, differs = read_rig(file).settings_doubts
    assert dynamic.startswith("dynamic contrast is on")
    assert differs.endswith("brightness_percent 35, not 60")


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
    assert read_rig(_rig(tmp_path, "")).verification is None
    (tmp_path / "records").mkdir()
    record = _write(tmp_path / "records")
    named = read_rig(_rig(tmp_path, "photodiode_verification: records/photodiode.yaml\n")).verification
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
