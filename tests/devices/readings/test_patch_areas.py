"""The area and the surround of patches: kept by every kind of file, absent from old ones, and out of the fit."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from devices.characterise import fit_display
from devices.diagnostics import plain
from devices.diagnostics.readings import by_code
from devices.errors import DeviceError
from devices.readings import (
    MeasurementLog,
    Measurements,
    Patch,
    PatchSet,
    Place,
    Reading,
    find_patches,
    read_csv,
    read_measurements,
    step_facts,
    steps,
    write_csv,
)
from devices.readings.csv_table import format_csv, parse_csv
from devices.readings.table import joined
from devices.readings.ti3 import format_ti3, parse_ti3
from tests.devices.diagnostics.simulated import characterisation

OLD = Measurements(np.array([[0.2, 0.2, 0.2], [1, 1, 1]]), np.array([[4, 5, 6], [95.0, 100, 108]]), ("a", "b"))
PARTS = Measurements(
    OLD.codes, OLD.XYZ, OLD.name, area=np.array([1 / 9, 1.0]), surround=np.array([[1.0, 0.2, 0.6], [0.0, 0.0, 0.0]])
)
HEADER = "name,red,green,blue,X,Y,Z,area,surround_red,surround_green,surround_blue\n"


def _same(found: Measurements) -> None:
    np.testing.assert_allclose(found.filled, PARTS.filled, atol=1e-12)
    np.testing.assert_allclose(found.around, PARTS.around, atol=1e-12)


def test_tables_keep_what_a_patch_filled_and_what_was_around_it(tmp_path: Path) -> None:
    write_csv(PARTS, tmp_path / "t.csv")
    _same(read_csv(tmp_path / "t.csv"))
    _same(parse_ti3(format_ti3(PARTS).splitlines(), "t.ti3"))


def test_a_measurement_on_disk_keeps_them(tmp_path: Path) -> None:
    patches = (
        Patch("a", (0.2, 0.2, 0.2), around=(1.0, 0.2, 0.6)),
        Patch("b", (1.0, 1.0, 1.0), before=(0.0, 0.0, 0.0)),
        Patch("c", (1.0, 1.0, 1.0), area=0.25),
    )
    order = steps(PatchSet("s", patches, characterisation=False), 1, shuffled=False)
    header = {
        "steps": step_facts(order), "eye": "both", "mode": "flat", "instrument": "none", "set": "s", "set_source": "",
        "seed": 1, "begun_utc": "2024-01-01T00:00:00+00:00", "highest_code": 255,
    }  # fmt: skip
    with MeasurementLog.create(tmp_path / "m.jsonl", header) as log:
        for step in order:
            log.keep(step, float(step.position), Reading((95.0, 100.0, 108.0)))
    found = read_measurements(tmp_path / "m.jsonl")
    np.testing.assert_allclose(found.filled, [1 / 9, 1.0, 0.25])
    np.testing.assert_allclose(found.around, [[1.0, 0.2, 0.6], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])


def test_old_tables_read_as_patches_that_filled_the_picture() -> None:
    for found in (
        parse_csv(["name,red,green,blue,X,Y,Z\n", "a,0,0,255,1,2,3\n"], "t.csv"),
        parse_ti3(format_ti3(OLD).splitlines(), "t.ti3"),
    ):
        assert found.area is None
        assert found.surround is None
        assert np.all(found.filled == 1)
        assert "area" not in format_csv(found)
        assert len(plain(found)) == len(found)


def test_empty_cells_stand_for_all_of_the_picture() -> None:
    found = parse_csv([HEADER, "a,0,0,255,1,2,3,,,,\n", "b,0,0,255,1,2,3,0.1,255,0,0\n"], "t.csv")
    assert found.filled.tolist() == [1.0, 0.1]
    assert found.around.tolist() == [[0, 0, 0], [1, 0, 0]]


@pytest.mark.parametrize(
    ("lines", "says"),
    [
        ([HEADER, "a,0,0,255,1,2,3,0,0,0,0\n"], "t.csv:2:8: the area is '0'"),
        ([HEADER, "a,0,0,255,1,2,3,1.5,0,0,0\n"], "t.csv:2:8: the area is '1.5'"),
        ([HEADER, "a,0,0,255,1,2,3,much,0,0,0\n"], "t.csv:2:8: area is 'much'"),
        (["# codes: 0..255\n", HEADER, "a,0,0,255,1,2,3,0.5,300,0,0\n"], "t.csv:3:9: the code 300 lies outside 0..255"),
        (["name,red,green,blue,X,Y,Z,surround_red\n", "a,0,0,255,1,2,3,0\n"], "has no surround_green, surround_blue"),
    ],
)
def test_wrong_areas_and_surrounds_name_their_place(lines: list[str], says: str) -> None:
    with pytest.raises(DeviceError) as told:
        parse_csv(lines, "t.csv")
    assert says in str(told.value)


def test_an_area_of_nothing_in_a_ti3_names_its_place() -> None:
    text = format_ti3(PARTS).replace(" 11.1111111111 ", " 0 ")
    with pytest.raises(DeviceError, match=r"t\.ti3:\d+:\d+: PATCH_AREA is 0"):
        parse_ti3(text.splitlines(), "t.ti3")


def test_tables_refuse_what_no_patch_can_fill() -> None:
    with pytest.raises(DeviceError, match="an area is a share"):
        Measurements(OLD.codes, OLD.XYZ, area=np.array([0.0, 1.0]))
    with pytest.raises(DeviceError, match="surround must lie in"):
        Measurements(OLD.codes, OLD.XYZ, surround=np.full((2, 3), 1.5))


def test_tables_with_and_without_areas_are_joined() -> None:
    both = joined([OLD, PARTS])
    np.testing.assert_allclose(both.filled, [1, 1, 1 / 9, 1])
    np.testing.assert_allclose(both.around[2], PARTS.around[0])
    _same(both.select([2, 3]))


CLEAN = characterisation(noise=0.0)
DIM = Measurements(CLEAN.codes, 0.5 * CLEAN.XYZ, CLEAN.name, CLEAN.time_s, area=np.full(len(CLEAN), 0.1))


def test_patches_with_a_surround_are_not_plain() -> None:
    every = joined([CLEAN, DIM])
    assert len(plain(every)) == len(CLEAN)
    assert by_code(every) == by_code(CLEAN)


@pytest.mark.nightly
@pytest.mark.usefixtures("fits_kept")
def test_patches_with_a_surround_are_no_part_of_the_fit() -> None:
    every = joined([CLEAN, DIM])
    fit, alone = fit_display(every, model="gog"), fit_display(CLEAN, model="gog")
    found, expected = (one.eyes["both"].characterisation.chosen.held_out for one in (fit, alone))
    assert found == expected
    assert f"{len(CLEAN)} readings" in " ".join(fit.notes)


def test_patch_files_say_area_and_surround(tmp_path: Path) -> None:
    file = tmp_path / "own.csv"
    file.write_text(
        "# codes: 0..255\nname,red,green,blue,area,surround_red,surround_green,surround_blue\n"
        "a,255,255,255,0.1,0,0,0\nb,51,51,51,,255,0,0\nc,0,0,0,,,,\n"
    )
    a, b, c = find_patches(str(file)).patches
    assert (a.filled, a.surround) == (0.1, (0, 0, 0))
    assert (b.filled, b.surround) == (1 / 9, (1, 0, 0))
    assert (c.filled, c.around, c.area) == (1, None, None)
    file.write_text("# codes: 0..255\nname,red,green,blue,area,surround_red\na,255,255,255,2,0\n")
    with pytest.raises(DeviceError) as told:
        find_patches(str(file))
    assert "own.csv:2: the header has no surround_green" in str(told.value)
    assert "own.csv:3:5: the area is '2'" in str(told.value)


def test_a_patch_has_one_area() -> None:
    assert Patch("a", (0, 0, 0), place=Place(1, 1, 2, 2)).filled == 0.25
    with pytest.raises(DeviceError, match="a cell of a grid, which is its area"):
        Patch("a", (0, 0, 0), place=Place(1, 1), area=0.5)
    with pytest.raises(DeviceError, match="has the area 0"):
        Patch("a", (0, 0, 0), area=0.0)


@pytest.mark.nightly
@pytest.mark.usefixtures("fits_kept")
def test_a_display_measured_on_one_surround_throughout_is_fitted_so() -> None:
    table = replace(CLEAN, area=DIM.area, surround=np.full((len(CLEAN), 3), 0.5))
    assert len(plain(plain(table))) == len(CLEAN)
    fit, alone = fit_display(table, model="gog"), fit_display(CLEAN, model="gog")
    found, expected = (one.eyes["both"].characterisation.chosen.held_out for one in (fit, alone))
    assert found == expected
    assert "10 % of the picture, with codes 128" in " ".join(fit.notes)
    assert len(plain(replace(CLEAN, area=np.linspace(0.1, 0.9, len(CLEAN))))) == 0


def test_a_set_in_part_of_the_picture_has_its_black_and_white_there_too() -> None:
    patches = find_patches("table_c1").in_part(0.25, (0.5, 0.5, 0.5))
    assert {(step.patch.filled, step.patch.surround) for step in steps(patches, 1)} == {(0.25, (0.5, 0.5, 0.5))}
    for name in ("crosstalk", "uniformity", "on-white", "cable"):
        assert find_patches(name).in_part(0.25, None) == find_patches(name)
