"""Regions files and viewing distances made to do harm: absurd numbers, more areas than anyone names."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

from documents import InputError
from stimuli.comparison import place_regions, read_regions
from stimuli.comparison.areas import area_means
from stimuli.comparison.regions import corner_pairs
from stimuli.comparison.regions_file import MOST_AREAS
from stimuli.measures import SeenPicture
from stimuli.measures.scielab import MOST_PIXELS_PER_DEGREE

SHAPE = (40, 60, 3)


def refused(tmp_path: Path, regions: str) -> list[str]:
    path = tmp_path / "r.yaml"
    path.write_text(f"schema_version: 1\nregions:\n{regions}", encoding="utf-8")
    began_s = time.process_time()
    with pytest.raises(InputError) as caught:
        place_regions(read_regions(path), SHAPE)
    assert time.process_time() - began_s < 5
    return [str(finding).removeprefix(f"{tmp_path}/") for finding in caught.value.findings]


@pytest.mark.parametrize("number", [".nan", ".inf", "1e308", "-1e308", "1e10", "1" + "0" * 40])
@pytest.mark.parametrize(
    "region",
    [
        "{{kind: rectangle, name: a, box: [{}, 0, 5, 5]}}",
        "{{kind: rectangle, name: a, box: [0, 0, 5, 5], rendering_box: [0, {}, 5, 5]}}",
        "{{kind: polygon, name: a, points: [[0, 0], [5, {}], [5, 5]]}}",
        "{{kind: plate, corners: [[0, 0], [9, 0], [9, {}], [0, 9]]}}",
    ],
)
def test_absurd_places_are_refused_where_they_stand(tmp_path: Path, region: str, number: str) -> None:
    (told,) = refused(tmp_path, f"  - {region.format(number)}\n")
    # YAML reads the number at its own place; a fault of a list is told at the value too.
    assert told.startswith(f"r.yaml:3:{5 + region.replace('{{', '{').index('{}')}: "), told
    assert len(told) < 300


def test_places_of_both_pictures_never_overflow(tmp_path: Path) -> None:
    path = tmp_path / "r.yaml"
    corners = "[[-1e9, -1e9], [1e9, -1e9], [1e9, 1e9], [-1e9, 1e9]]"
    plate = f"{{kind: plate, corners: {corners}, rendering_corners: {corners}}}"
    path.write_text(f"schema_version: 1\nunits: share\nregions: [{plate}]\n", encoding="utf-8")
    found = corner_pairs(read_regions(path), SHAPE, SHAPE)
    assert found is not None
    assert np.isfinite(found).all()


@pytest.mark.parametrize("grids", [2, 1000])
def test_more_areas_than_anyone_names_are_refused(tmp_path: Path, grids: int) -> None:
    lines = [f"  - {{kind: grid, name: g{number}, rows: 100, columns: 100}}\n" for number in range(grids)]
    (told,) = refused(tmp_path, "".join(lines))
    assert told == f"r.yaml:4:5: with 'g1' these are 20000 areas (a regions file has {MOST_AREAS} at most)"


def test_a_grid_of_a_milliard_cells_is_refused(tmp_path: Path) -> None:
    (told,) = refused(tmp_path, "  - {kind: grid, name: g, rows: 1000000000, columns: 3}\n")
    assert told.startswith("r.yaml:3:")


def test_ten_thousand_faults_are_told_in_part() -> None:
    outline = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    with pytest.raises(InputError) as caught:
        area_means(np.ones(SHAPE), [(f"cell {number}", outline) for number in range(200)], least_pixels=25)
    told = [str(finding) for finding in caught.value.findings]
    assert len(told) == 21
    assert told[-1] == "180 more regions have such faults"


@pytest.mark.parametrize("pixels_per_degree", [1.01 * MOST_PIXELS_PER_DEGREE, 1e9, 1e300])
def test_a_picture_seen_from_the_moon_is_refused(pixels_per_degree: float) -> None:
    with pytest.raises(InputError, match="check the viewing distance"):
        SeenPicture(np.ones(SHAPE), pixels_per_degree, np.ones(3))
