"""Modes written into display files: what is new is there, what was there stays, what would go is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from devices.characterise.mode_file import ModeLines, write_mode
from devices.display import DisplayModel, PanelSpec, ToneCurve, read_display
from devices.display.model_spec import ModelSpec
from devices.errors import DeviceError

ROOT = Path(__file__).parents[3]
PANEL = PanelSpec(resolution_px=(640, 480), pixel_pitch_mm=0.25, refresh_hz=120, bits=10)
CROSSTALK = ["crosstalk:", *(f"  {eye}: [[0.03, 0, 0], [0, 0.03, 0], [0, 0, 0.05]]" for eye in ("left", "right"))]


def _model(white: float) -> list[str]:
    primaries = np.array([[4.0, 3, 2], [2, 7, 1], [0, 1, 9]]) * white
    return ModelSpec.of(
        DisplayModel(np.zeros(3), primaries, (ToneCurve(1, 0, 2.2),) * 3), source=f'white {white}, "measured"'
    ).lines()


def _new(parts: dict[str, list[str]] | None = None, **whites: float) -> ModeLines:
    return ModeLines({eye: _model(white) for eye, white in whites.items()}, parts or {})


def _white(path: Path, mode: str, eye: str = "left") -> float:
    models = read_display(path).models(mode)
    return float((models.left if eye == "left" else models.right).white_XYZ_cd_m2[1] / 10)


@pytest.fixture
def shipped(tmp_path: Path) -> Path:
    path = tmp_path / "asus.yaml"
    path.write_bytes((ROOT / "configs" / "displays" / "asus_vg248qe.yaml").read_bytes())
    return path


def test_a_new_file_has_its_panel_and_mode(tmp_path: Path) -> None:
    path = tmp_path / "d.yaml"
    assert write_mode(path, "flat", _new(both=2.0), PANEL).startswith(f"wrote {path}")
    assert read_display(path).panel == PANEL
    assert _white(path, "flat") == pytest.approx(2)
    with pytest.raises(DeviceError, match="no such display file yet"):
        write_mode(tmp_path / "e.yaml", "flat", _new(both=2.0))
    assert [p.name for p in tmp_path.iterdir()] == ["d.yaml"]


def test_an_added_mode_changes_no_line(shipped: Path) -> None:
    before = shipped.read_text()
    write_mode(shipped, "flat", _new(both=2.0))
    assert shipped.read_text().startswith(before)
    assert _white(shipped, "flat") == pytest.approx(2)


def test_replacing_takes_a_word_and_leaves_the_rest(shipped: Path) -> None:
    before = shipped.read_bytes()
    with pytest.raises(DeviceError, match=r"asus.yaml:5:3: .*for both"):
        write_mode(shipped, "quad-buffered", _new(both=2.0))
    assert shipped.read_bytes() == before
    told = write_mode(shipped, "quad-buffered", _new(both=2.0), replace=True)
    assert "went with it: 1." in told  # '# Expression 3.12'
    assert "The same as it: side-by-side." in told
    after = shipped.read_text().split("\n")
    assert _white(shipped, "quad-buffered") == _white(shipped, "side-by-side") == pytest.approx(2)
    for line in ("# Asus VG248QE", "panel: ", "modes:  ", "    # The thesis gives no black", "  side-by-side: {"):
        (kept,) = (old for old in before.decode().split("\n") if old.startswith(line))
        assert kept in after


def test_an_eye_is_written_by_itself(tmp_path: Path) -> None:
    path = tmp_path / "d.yaml"
    told = write_mode(path, "flat", _new(right=2.0), PANEL)
    assert "cannot be used before its left eye" in told
    told = write_mode(path, "flat", _new(left=3.0))
    assert "cannot be used" not in told
    assert (_white(path, "flat"), _white(path, "flat", "right")) == pytest.approx((3, 2))
    with pytest.raises(DeviceError, match="of the left eye already"):
        write_mode(path, "flat", _new(left=4.0))
    with pytest.raises(DeviceError, match="of the right eye already"):
        write_mode(path, "flat", _new(both=4.0))
    write_mode(path, "flat", _new(left=4.0), replace=True)
    assert (_white(path, "flat"), _white(path, "flat", "right")) == pytest.approx((4, 2))
    write_mode(path, "flat", _new(both=5.0), replace=True)
    assert (_white(path, "flat"), _white(path, "flat", "right")) == pytest.approx((5, 5))


def test_one_eye_in_place_of_both_leaves_none_for_the_other(shipped: Path) -> None:
    with pytest.raises(DeviceError, match="for both eyes already"):
        write_mode(shipped, "quad-buffered", _new(left=4.0))
    told = write_mode(shipped, "quad-buffered", _new(left=4.0), replace=True)
    assert "cannot be used before its right eye" in told
    assert read_display(shipped).lacking == {"quad-buffered": ("right",), "side-by-side": ("right",)}


def test_a_mode_that_was_the_same_as_another_gets_its_own(shipped: Path) -> None:
    with pytest.raises(DeviceError, match="holds 'same_as: quad-buffered' already"):
        write_mode(shipped, "side-by-side", _new(both=2.0))
    write_mode(shipped, "side-by-side", _new(both=2.0), replace=True)
    assert _white(shipped, "side-by-side") == pytest.approx(2)
    assert _white(shipped, "quad-buffered") == pytest.approx(2.647)


def test_parts_are_added_by_themselves_and_kept_when_the_model_changes(shipped: Path) -> None:
    before = shipped.read_text()
    write_mode(shipped, "quad-buffered", _new({"crosstalk": CROSSTALK}))
    after = shipped.read_text()
    assert after.replace("".join(f"    {line}\n" for line in CROSSTALK), "") == before
    assert read_display(shipped).crosstalk("side-by-side") is not None
    told = write_mode(shipped, "quad-buffered", _new({"crosstalk": CROSSTALK}))
    assert "There already, and the same: crosstalk." in told
    assert shipped.read_text() == after
    with pytest.raises(DeviceError, match="holds crosstalk already"):
        write_mode(shipped, "quad-buffered", _new({"crosstalk": [line.replace("0.05", "0.06") for line in CROSSTALK]}))
    told = write_mode(shipped, "quad-buffered", _new(both=2.0), replace=True)
    assert "stays: crosstalk, monitor_settings." in told
    assert read_display(shipped).crosstalk("quad-buffered") is not None
    with pytest.raises(DeviceError, match="write into 'quad-buffered'"):
        write_mode(shipped, "side-by-side", _new({"crosstalk": CROSSTALK}), replace=True)
    with pytest.raises(DeviceError, match="there is no mode 'flat' to add to"):
        write_mode(shipped, "flat", _new({"crosstalk": CROSSTALK}))


def test_what_would_not_read_is_not_put_in_place(shipped: Path) -> None:
    before = shipped.read_bytes()
    dark = [line.replace("red:   [8", "red:   [1e-30") for line in _model(2.0)]
    bad = ModeLines({"both": [line.replace("gamma: 2.2", "gamma: -1") for line in dark]}, {})
    with pytest.raises(DeviceError, match=r"asus.yaml: the file would not be right"):
        write_mode(shipped, "flat", bad)
    with pytest.raises(DeviceError, match="another panel"):
        write_mode(shipped, "flat", _new(both=2.0), PANEL)
    assert shipped.read_bytes() == before
    assert [p.name for p in shipped.parent.iterdir()] == ["asus.yaml"]


def test_a_link_stays_a_link_and_permissions_stay(shipped: Path, tmp_path: Path) -> None:
    link = tmp_path / "link.yaml"
    link.symlink_to(shipped)
    shipped.chmod(0o640)
    write_mode(link, "flat", _new(both=2.0))
    assert link.is_symlink()
    assert shipped.stat().st_mode & 0o777 == 0o640
    assert _white(shipped, "flat") == pytest.approx(2)


def test_braces_are_refused_with_their_place(tmp_path: Path) -> None:
    path = tmp_path / "d.yaml"
    write_mode(path, "flat", _new(both=2.0), PANEL)
    path.write_text(
        "{" + f"schema_version: 1, panel: {{resolution_px: [9, 9], pixel_pitch_mm: 1}}, modes: {BRACES}" + "}"
    )
    with pytest.raises(DeviceError, match=r"d.yaml:1:\d+: .*in braces"):
        write_mode(path, "quad-buffered", _new(both=2.0))


BRACES = (
    "{flat: {black_XYZ_cd_m2: [0, 0, 0], primaries_XYZ_cd_m2: {red: [4, 2, 0], green: [3, 7, 1], blue: [2, 1, 9]}, "
    "curve: {kind: gamma, red: {gamma: 2}, green: {gamma: 2}, blue: {gamma: 2}}}}"
)
