"""The monitor's settings and the graphics card's gamma table: stated, compared, kept."""

from __future__ import annotations

import hashlib
import re
import zlib
from base64 import b64encode
from pathlib import Path
from typing import Any, cast
from unittest.mock import Mock

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from devices.characterise import fit_display, table_c1_codes, thesis_display
from devices.diagnostics import judge_display
from devices.display import (
    GammaTable,
    MonitorSettings,
    PanelSpec,
    Verification,
    read_display,
    read_rig,
    read_verification,
)
from devices.errors import DeviceError
from devices.readings import Measurements, read_measurements, write_csv
from devices.readings.table import joined
from devices.readings.ti3 import format_ti3, parse_ti3
from documents import InputError

# The monitor's settings: stated, compared, carried from the rig through readings into the display file.
#
# Records of a photodiode's verification: read, refused with the place, and held against a session.

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
    assert found.to_json()["left_onset_error_ms"]["worst"] == -4.9
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


# The gamma table: read back by drivers of other sizes and bits, it is the same; changed, it is not.

SIZES = st.sampled_from([17, 256, 1024, 2048, 4096])
BITS = st.sampled_from([8, 10, 12, 16])
ROUNDED = st.sampled_from(["floor", "nearest"])
WRITTEN = st.sampled_from(["zeros", "again", "rounded"])


def read_back(shares: NDArray[np.float64], bits: int, rounded: str, written: str) -> GammaTable:
    """``shares`` (n,) as a driver with hardware of ``bits`` bits returns them."""
    highest = 2**bits - 1
    value = (np.floor(shares * highest + 1e-9) if rounded == "floor" else np.rint(shares * highest)).astype(np.int64)
    if written == "zeros":
        entries = value << (16 - bits)
    elif written == "again":
        entries = value << (16 - bits) | value >> (2 * bits - 16)
    else:
        entries = np.rint(value * (65535 / highest)).astype(np.int64)
    return GammaTable(np.repeat(entries[:, None], 3, axis=1))


def curve(size: int, exponent: float) -> NDArray[np.float64]:
    return np.linspace(0, 1, size) ** exponent


@settings(max_examples=15)
@given(SIZES, BITS, ROUNDED, WRITTEN)
def test_an_identity_in_any_size_and_rounding_is_the_identity(size: int, bits: int, rounded: str, written: str) -> None:
    table = read_back(curve(size, 1.0), bits, rounded, written)
    assert table.is_identity
    assert table.same_as(GammaTable.identity())
    assert GammaTable.identity(1024).same_as(table)
    assert table.bits <= bits


@settings(max_examples=15)
@given(SIZES, ROUNDED, WRITTEN, st.sampled_from([0.5, 0.9, 1.01, 1.1, 2.2]))
def test_a_calibration_is_none(size: int, rounded: str, written: str, exponent: float) -> None:
    # Of 8 bits, gamma 1.01 departs by less than a step.
    for bits in (10, 16) if exponent == 1.01 else (8, 10, 16):
        table = read_back(curve(size, exponent), bits, rounded, written)
        assert not table.is_identity
        assert table.same_as(GammaTable.identity(size)) is False
        assert GammaTable.identity(256).same_as(table) is False


@settings(max_examples=15)
@given(SIZES, SIZES, BITS, ROUNDED, WRITTEN)
def test_a_calibration_read_by_another_driver_is_the_same(
    first: int, second: int, bits: int, rounded: str, written: str
) -> None:
    if 17 in (first, second):
        first = second = 17  # a line between 17 entries is no power
    one = GammaTable.from_shares(curve(first, 1.3))
    two = read_back(curve(second, 1.3), bits, rounded, written)
    assert one.same_as(two)
    assert two.same_as(one)
    other = read_back(curve(second, 1.35), bits, rounded, written)
    assert one.same_as(other) is False


@pytest.mark.parametrize("size", [256, 1024, 4096])
def test_one_step_of_one_entry_is_a_change(size: int) -> None:
    """The smallest change that hardware of 8 bits can make, and of 12 bits: both are found."""
    for bits, exponent in ((8, 1.0), (8, 1.3), (12, 1.0), (12, 1.3)):
        entries = np.array(read_back(curve(size, exponent), bits, "nearest", "zeros").entries)
        changed = entries.copy()
        changed[size // 2, 1] += 2 << (16 - bits)
        assert GammaTable(entries).same_as(GammaTable(changed)) is False
        assert GammaTable(entries).same_as(GammaTable(entries)) is True


def test_departures_are_codes_of_8_bits() -> None:
    entries = np.array(GammaTable.identity(256).entries)
    entries[100, 2] += 5 * 257
    assert GammaTable(entries).departure_codes == pytest.approx(5.0)
    assert GammaTable(entries).bits == 8
    assert GammaTable(np.zeros((256, 3), np.uint16)).departure_codes == pytest.approx(255)


def test_hash_is_of_the_bits_not_of_how_they_are_written() -> None:
    ways = {read_back(curve(256, 1.4), 8, "nearest", how).sha256 for how in ("zeros", "again", "rounded")}
    assert len(ways) == 1
    assert read_back(curve(256, 1.41), 8, "nearest", "zeros").sha256 not in ways
    assert GammaTable.identity(256).sha256 != GammaTable.identity(1024).sha256


@settings(max_examples=15)
@given(SIZES, st.floats(0.3, 3.0))
def test_records_give_the_table_back(size: int, exponent: float) -> None:
    table = GammaTable.from_shares(np.stack([curve(size, exponent), curve(size, 1.0), curve(size, 1.2)], axis=1))
    held = GammaTable.from_json(table.to_json())
    assert np.array_equal(np.asarray(held.entries), np.asarray(table.entries))
    identity = read_back(curve(size, 1.0), 10, "floor", "zeros")
    assert "entries" not in identity.to_json()
    assert GammaTable.from_json(identity.to_json()).same_as(identity)


def test_unknown_is_neither_same_nor_other() -> None:
    unknown = GammaTable.unreadable("Wayland has none")
    assert GammaTable.from_json(unknown.to_json()).unknown == "Wayland has none"
    assert unknown.same_as(GammaTable.identity()) is None
    assert GammaTable.identity().same_as(unknown) is None
    assert not unknown.is_identity
    assert np.isnan(unknown.departure_codes)
    assert unknown.sentence() == "unknown (Wayland has none)"
    with pytest.raises(DeviceError, match="Wayland has none"):
        assert unknown.shares.size


def test_shares_at_other_codes_are_interpolated() -> None:
    codes = np.array([0.0, 0.5, 0.8, 1.0])
    table = GammaTable.from_shares(codes / 2, codes)
    assert np.allclose(table.shares[:, 0], [0, 1 / 6, 1 / 3, 1 / 2], atol=1e-5)
    assert np.allclose(table.at([0.0, 0.25, 1.0])[:, 1], [0, 0.125, 0.5], atol=1e-5)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: GammaTable(None), "needs a reason"),
        (lambda: GammaTable(np.zeros((256, 4), np.uint16)), r"\(256, 4\)"),
        (lambda: GammaTable(np.zeros((1, 3), np.uint16)), r"\(1, 3\)"),
        (lambda: GammaTable(np.full((4, 3), 70000)), "whole numbers"),
        (lambda: GammaTable(cast(Any, np.zeros((4, 3)))), "whole numbers"),
        (lambda: GammaTable.from_shares([0.0, 1.2]), "in 0..1"),
        (lambda: GammaTable.from_shares([0.0, np.nan]), "in 0..1"),
        (lambda: GammaTable.from_shares([0.0, 0.5, 1.0], [0.0, 1.0, 0.5]), "rise from 0 to 1"),
        (lambda: GammaTable.from_json({"size": 4}), "size and hash"),
        (lambda: GammaTable.from_json({"size": 10**9, "hash": ""}), "2 to 65536"),
        (lambda: GammaTable.from_json({"size": 4, "hash": "", "departure_codes": 3.0}), "needs its entries"),
        (lambda: GammaTable.from_json({"size": 4, "hash": "", "entries": "%"}), "cannot be read"),
        (lambda: GammaTable.from_json({"size": 4, "hash": "", "entries": packed(3)}), "does not hold the 4 entries"),
        (lambda: GammaTable.from_json({"size": 4, "hash": "", "entries": packed(10**6)}), "does not hold the 4"),
        (lambda: GammaTable.from_json({"size": 4, "hash": "no", "entries": packed(4)}), "is not that of its entries"),
    ],
)
def test_wrong_tables_are_refused(make: object, words: str) -> None:
    assert callable(make)
    with pytest.raises(DeviceError, match=words):
        make()


def packed(size: int) -> str:
    return b64encode(zlib.compress(bytes(6 * size))).decode()


def test_entries_are_decoded_once_and_nobody_changes_what_they_stand_for(monkeypatch: pytest.MonkeyPatch) -> None:
    from devices.display import gamma_table

    decode = Mock(wraps=gamma_table._decoded)
    monkeypatch.setattr(gamma_table, "_decoded", decode)
    table, other = (GammaTable.from_shares(np.linspace(0.0, 1.0, 256) ** power) for power in (1.0, 1.2))
    assert not table.same_as(other)
    assert (table.bits, table.is_identity, other.is_identity) == (8, True, False)
    assert table.to_json() != other.to_json()
    assert decode.call_count == 2
    with pytest.raises(ValueError, match="read-only"):
        table.shares[0] = 1.0
