"""The monitor's settings: stated, compared, carried from the rig through readings into the display file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from devices.characterise import fit_display, table_c1_codes, thesis_display
from devices.diagnostics import judge_display
from devices.display import MonitorSettings, PanelSpec, read_display, read_rig
from devices.errors import DeviceError
from devices.measurements import Measurements, read_measurements, write_csv
from devices.measurements.table import joined
from devices.measurements.ti3 import format_ti3, parse_ti3

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
