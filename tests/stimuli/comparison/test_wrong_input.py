"""What cannot be compared, or is made to do harm, is refused in one line and nothing is written."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from devices.camera import CameraModel, Exposure, write_camera
from documents import InputError
from documents.arrays import Floats32
from runner.reports import check_page
from runner.reports.comparison.experiment import checked_name
from stimuli.comparison import place_regions, read_regions
from stimuli.comparison.areas import area_means
from stimuli.comparison.regions import corner_pairs
from stimuli.comparison.regions_file import MOST_AREAS
from stimuli.develop import CameraImage, write_camera_exr
from stimuli.measures import SeenPicture
from stimuli.measures.scielab import MOST_PIXELS_PER_DEGREE
from tests.choice import nightly
from tests.kept import known
from tests.stimuli.comparison.scenes import CHART, PLATE, RIG, SIZE, Cyclopean, chart, spots, written

# What cannot be compared is refused in one line, with exit status 2, and nothing is written.

Refused = Callable[..., str]

MATRIX = np.array([[60.0, 25.0, 15.0], [25.0, 80.0, 5.0], [1.0, 10.0, 120.0]])


@pytest.fixture
def refused(tmp_path: Path, cyclopean: Cyclopean, monkeypatch: pytest.MonkeyPatch) -> Refused:
    """Run the command asking for a page and an experiment; return its one line of complaint."""
    monkeypatch.chdir(tmp_path)

    def run(*words: object) -> str:
        before = sorted(tmp_path.rglob("*"))
        more: Sequence[object] = ("--rig", RIG, "-o", tmp_path / "out.html", "--experiment", "study")
        told = cyclopean("compare", *words, *more, expect=2)
        assert sorted(tmp_path.rglob("*")) == before
        assert told.stdout == ""
        lines = told.stderr.splitlines()
        assert len(lines) == 1, told.stderr
        return lines[0]

    return run


def camera_rgb(path: Path, exposure: Exposure | None) -> Path:
    rgb = (chart() @ np.linalg.inv(MATRIX).T).astype(np.float32)
    write_camera_exr(path, CameraImage(rgb, np.zeros(rgb.shape, dtype=np.bool_), exposure, path.name))
    return path


@pytest.mark.parametrize("name", ["b.png", "b.tif"])
@pytest.mark.parametrize("told", [(), ("--rendering-holds", "xyz")])
def test_eight_bits_are_no_light(tmp_path: Path, refused: Refused, name: str, told: tuple[str, ...]) -> None:
    from PIL import Image

    Image.fromarray(np.full((180, 240, 3), 120, np.uint8)).save(tmp_path / name)
    line = refused(written(tmp_path / "a.exr", spots()), tmp_path / name, "--regions", PLATE, *told)
    assert f"{name}: the rendering has 8 bits a channel" in line
    assert "OpenEXR" in line
    assert "holds xyz" not in line


RENDERINGS: dict[str, tuple[Callable[[], Floats32], str, tuple[str, ...]]] = {
    "size": (lambda: spots(size=(200, 180)), "", ("240 × 180", "--register auto")),
    "beyond": (lambda: spots(dx=40.0), "[170, 20, 60, 40]", ("'rim' lie beyond the rendering's edge",)),
    "outside": (spots, "[200, 20, 60, 40]", ("r.yaml:3:", "'rim'", "240 × 180")),
    "nothing in common": (lambda: spots(seed=1), "", ("cannot be brought onto the photograph", "--register none")),
    "turned": (lambda: spots()[::-1, ::-1], "", ("the rendering is turned by", "180.0°")),
}


@pytest.mark.parametrize("why", ["size", "outside", *nightly("beyond", "nothing in common", "turned")])
def test_a_rendering_that_does_not_lie_on_the_photograph(tmp_path: Path, refused: Refused, why: str) -> None:
    rendering, box, complaints = RENDERINGS[why]
    regions = tmp_path / "r.yaml" if box else PLATE
    if box:
        regions.write_text(f"schema_version: 1\nregions: [{{kind: rectangle, name: rim,\n  box: {box}}}]\n", "utf-8")
    files = written(tmp_path / "a.exr", spots()), written(tmp_path / "b.exr", rendering())
    line = refused(*files, "--regions", regions, *(("--register", "none") if why == "size" else ()))
    assert [complaint for complaint in complaints if complaint not in line] == []


@pytest.mark.nightly
def test_a_rendering_of_another_scale(tmp_path: Path, refused: Refused) -> None:
    large = spots(size=(480, 360), sd_px=1.8, amplitude=1200.0, count=900)
    small = large.reshape(180, 2, 240, 2, 3).mean(axis=(1, 3))
    files = written(tmp_path / "a.exr", small), written(tmp_path / "b.exr", large)
    assert "is 2 times as large as the photograph" in refused(*files, "--regions", PLATE)


def test_camera_rgb_without_a_camera_file(tmp_path: Path, refused: Refused) -> None:
    (tmp_path / "r.yaml").write_text(CHART, encoding="utf-8")
    photo = camera_rgb(tmp_path / "a.exr", Exposure(1 / 15, 8.0, 200.0))
    line = refused(photo, written(tmp_path / "b.exr", chart()), "--regions", tmp_path / "r.yaml")
    assert "a.exr: the photograph is camera RGB" in line
    assert "--camera" in line


@pytest.mark.parametrize(
    ("exposure", "message"),
    [
        (Exposure(1 / 2, 8.0, 200.0), "was taken at 0.5 s, f/8, ISO 200"),
        (None, "file has no exposure"),
    ],
)
def test_a_camera_file_of_another_exposure(
    tmp_path: Path,
    refused: Refused,
    exposure: Exposure | None,
    message: str,
) -> None:
    (tmp_path / "r.yaml").write_text(CHART, encoding="utf-8")
    model = CameraModel(MATRIX, np.ones(3), np.zeros(3), Exposure(1 / 15, 8.0, 200.0), form="affine")
    write_camera(model, tmp_path / "c.yaml")
    photo = camera_rgb(tmp_path / "a.exr", exposure)
    told = ("--regions", tmp_path / "r.yaml", "--camera", tmp_path / "c.yaml")
    line = refused(photo, written(tmp_path / "b.exr", chart()), *told)
    assert "a.exr" in line
    assert message in line


def test_a_pair_beside_a_single_picture(tmp_path: Path, refused: Refused) -> None:
    files = written(tmp_path / "a.exr", spots(), spots(dx=1.0)), written(tmp_path / "b.exr", spots())
    line = refused(*files, "--regions", PLATE)
    assert "a pair for two eyes" in line


def test_a_file_that_is_not_there(tmp_path: Path, refused: Refused) -> None:
    files = written(tmp_path / "a.exr", spots()), tmp_path / "none.exr"
    assert "there is no such rendering" in refused(*files, "--regions", PLATE)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_values_that_are_no_numbers(tmp_path: Path, refused: Refused, bad: float) -> None:
    import OpenImageIO as oiio

    picture = spots().copy()
    picture[7, 9, 1] = bad
    spec = oiio.ImageSpec(*SIZE, 3, "float")
    spec.channelnames = ("X", "Y", "Z")
    output = known(oiio.ImageOutput.create(str(tmp_path / "b.exr")))
    assert output.open(str(tmp_path / "b.exr"), spec)
    assert output.write_image(picture)
    output.close()
    line = refused(written(tmp_path / "a.exr", spots()), tmp_path / "b.exr", "--regions", PLATE)
    assert "b.exr: 1 pixel is not finite" in line


# Names, places and texts made to do harm: `cyclopean compare` writes nothing where it should not.
@pytest.mark.parametrize(
    "name",
    ["", ".", "..", "../up", "/etc/x", "a/b", "a\\b", "a.yaml", "-x", "A", "é", "a b", "a\n", "a\x00", "x" * 61]
    + ["con", "prn", "aux", "nul", "com1", "lpt9", "\u202ea"],
)
def test_an_experiment_s_name_cannot_lead_elsewhere(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match="an experiment cannot be called") as caught:
        checked_name(name, tmp_path)
    assert str(caught.value).isprintable()


@pytest.mark.parametrize("name", ["a", "0", "console", "com10", "nul-1", "x" * 60])
def test_names_that_are_like_them_are_right(tmp_path: Path, name: str) -> None:
    checked_name(name, tmp_path)


@pytest.mark.parametrize("place", ["experiments/a.yaml", "configs/stimuli/a.yaml", "configs/stimuli/a"])
@pytest.mark.parametrize("there", ["file", "folder", "link that leads nowhere"])
def test_nothing_is_written_over_or_through(tmp_path: Path, place: str, there: str) -> None:
    path = tmp_path / place
    path.parent.mkdir(parents=True)
    if there == "link that leads nowhere":
        path.symlink_to(tmp_path / "outside.yaml")
    else:
        path.touch() if there == "file" else path.mkdir()
    with pytest.raises(InputError, match=re.escape(f"{place}: it is there already")):
        checked_name("a", tmp_path)


@pytest.mark.parametrize("place", ["a.html", "file/more/a.html"])
def test_where_no_page_can_be_is_told_before_anything_is_written(tmp_path: Path, place: str) -> None:
    (tmp_path / "a.html").mkdir()
    (tmp_path / "file").touch()
    output = tmp_path / place
    with pytest.raises(InputError) as caught:
        check_page(output, [])
    assert str(caught.value).startswith(str(output))


@pytest.mark.parametrize("text", ["nan,1", "1,inf", "1e10,1", "1", "1,2,3", ""])
def test_corners_are_numbers_that_a_picture_has(cyclopean: Cyclopean, text: str) -> None:
    told = cyclopean("compare", "a", "b", "--regions", PLATE, "--photo-corners", *("1,1", "2,1", text, "1,2"), expect=2)
    assert f"'--photo-corners': it is '{text}'" in told.stderr


BAD = "<img src=x onerror=alert(1)>&\"'"


# Regions files and viewing distances made to do harm: absurd numbers, more areas than anyone names.

SHAPE = (40, 60, 3)


def regions_refused(tmp_path: Path, regions: str) -> list[str]:
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
    (told,) = regions_refused(tmp_path, f"  - {region.format(number)}\n")
    # YAML reads the number at its own place; a fault of a list is told at the value too.
    assert told.startswith(f"r.yaml:3:{5 + region.replace('{{', '{').index('{}')}: "), told
    assert len(told) < 300


def test_places_of_both_pictures_never_overflow(tmp_path: Path) -> None:
    path = tmp_path / "r.yaml"
    corners = "[[-1e9, -1e9], [1e9, -1e9], [1e9, 1e9], [-1e9, 1e9]]"
    plate = f"{{kind: plate, corners: {corners}, rendering_corners: {corners}}}"
    path.write_text(f"schema_version: 1\nunits: share\nregions: [{plate}]\n", encoding="utf-8")
    found = known(corner_pairs(read_regions(path), SHAPE, SHAPE))
    assert np.isfinite(found).all()


@pytest.mark.parametrize("grids", [2, 1000])
def test_more_areas_than_anyone_names_are_refused(tmp_path: Path, grids: int) -> None:
    lines = [f"  - {{kind: grid, name: g{number}, rows: 100, columns: 100}}\n" for number in range(grids)]
    (told,) = regions_refused(tmp_path, "".join(lines))
    assert told == f"r.yaml:4:5: with 'g1' these are 20000 areas (a regions file has {MOST_AREAS} at most)"


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


# The regions file that the page shows can be read and placed.

PAGE = Path(__file__).parents[3] / "docs/compare.md"
