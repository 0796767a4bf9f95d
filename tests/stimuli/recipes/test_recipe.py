"""Recipes: what they may say, the step `adapt`, and large pictures made some rows at a time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from colour.adaptation import chromatic_adaptation_VonKries
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from pydantic import ValidationError

import stimuli.recipes.banded_picture
from devices.colour import white_point
from documents import InputError
from stimuli.build import StimulusSet, build_set
from stimuli.errors import StimulusError
from stimuli.pictures import StereoImage, exr_write, write_exr
from stimuli.recipes import BandedPicture, SeriesSpec, read_recipe
from stimuli.recipes.picture_steps import adapted, finished_picture
from stimuli.recipes.pictures import PicturesRecipe
from stimuli.recipes.steps_spec import AdaptSpec, StepsSpec
from tests.stimuli.oiio_files import save_parts

# What a recipe may say, and how it is told what it may not.


chromaticities = st.tuples(st.floats(0.05, 0.6), st.floats(0.05, 0.4))


def pictures(tmp_path: Path, body: str) -> Path:
    file = tmp_path / "recipe.yaml"
    file.write_text(f"schema_version: 1\nkind: pictures\n{body}")
    return file


@pytest.mark.parametrize("file", ["/tmp/a.exr", "../a.exr", "a/../../b.exr", "C:/a.exr", "..\\a.exr", "''"])
def test_pictures_stay_in_the_recipe_s_folder(tmp_path: Path, file: str) -> None:
    with pytest.raises(InputError, match=r"recipe\.yaml:4:23: .*the recipe's own folder"):
        read_recipe(pictures(tmp_path, f"stimuli:\n  - {{name: one, file: {file}}}\n"))


def test_names_that_differ_only_in_case_are_one_file_on_some_disks(tmp_path: Path) -> None:
    body = "stimuli:\n  - {name: one, file: a.exr}\n  - {name: One, file: b.exr}\n"
    with pytest.raises(InputError, match=r"recipe\.yaml:5:.*'One' stands twice"):
        read_recipe(pictures(tmp_path, body))


def test_views_are_said_once(tmp_path: Path) -> None:
    body = "views: [flat]\nstimuli:\n  - {name: one, file: a.exr, view: flat}\n"
    with pytest.raises(InputError, match="keep one of the two"):
        read_recipe(pictures(tmp_path, body))


def test_a_picture_s_defaults(tmp_path: Path) -> None:
    recipe, _ = read_recipe(pictures(tmp_path, "stimuli:\n  - {name: one, file: sub/a.exr}\n"))
    assert isinstance(recipe, PicturesRecipe)
    picture = recipe.stimuli[0]
    assert (picture.view, picture.colour_space, picture.negative) == (None, "declared", "refuse")


def test_factors_of_pictures(tmp_path: Path) -> None:
    file = tmp_path / "pictures.yaml"
    file.write_text(
        "schema_version: 1\nkind: pictures\nstimuli:\n"
        "  - {name: a, file: a.exr, factors: {paint: red, exposure_s: 2}}\n"
        "  - {name: b, file: b.exr, view: flat, flat_eye: left}\n"
    )
    pictures, _ = read_recipe(file)
    assert pictures.factors() == {
        "a": {"image": "a", "paint": "red", "exposure_s": 2},
        "b": {"image": "b", "view": "flat"},
    }


@pytest.mark.parametrize(
    ("factors", "message"),
    [
        ("{view: flat}", "set by the recipe"),
        ("{Paint: red}", "small letters"),
        ("{paint: true}", "'stimuli.1.factors.paint'"),
        ("{paint: ''}", "'stimuli.1.factors.paint'"),
    ],
)
def test_factors_that_cannot_be(tmp_path: Path, factors: str, message: str) -> None:
    file = tmp_path / "pictures.yaml"
    file.write_text(f"schema_version: 1\nkind: pictures\nstimuli:\n  - {{name: a, file: a.exr, factors: {factors}}}\n")
    with pytest.raises(InputError, match=rf"pictures\.yaml:4:\d+: .*{message}"):
        read_recipe(file)


@pytest.mark.parametrize("white_xy", ["[0.7, 0.7]", "[0.3, 0]", "[-0.1, 0.5]"])
def test_whites_that_no_light_has(tmp_path: Path, white_xy: str) -> None:
    body = f"series: [{{name: grey, greyscale_white_xy: {white_xy}}}]\nstimuli:\n  - {{name: one, file: a.exr}}\n"
    with pytest.raises(InputError, match=r"recipe\.yaml:3:\d+: .*x \+ y ≤ 1"):
        read_recipe(pictures(tmp_path, body))


@given(st.lists(st.floats(0, 2**13, width=32), min_size=3, max_size=3), chromaticities, st.floats(0.01, 100))
def test_grey_of_any_pixel(pixel: Sequence[float], white_xy: tuple[float, float], scale: float) -> None:
    spec = SeriesSpec(name="grey", greyscale_white_xy=white_xy)
    (grey,) = spec.apply(np.array([[pixel]], np.float32), scale)[0]
    luminance = pixel[1] * scale
    x, y = white_xy
    expected = [luminance * x / y, luminance, luminance * (1 - x - y) / y]
    np.testing.assert_allclose(grey, expected, rtol=1e-6, atol=1e-37)


# The step `adapt`: against colour-science on whole pictures, what it skips, and wrong input.
def picture(seed: int = 1) -> NDArray[np.float32]:
    return np.random.default_rng(seed).uniform(20.0, 60.0, (33, 20, 3)).astype(np.float32)


def spec(**keys: Any) -> AdaptSpec:
    return AdaptSpec.model_validate({"from_white": "A", "to_white": "d65", **keys})


@pytest.mark.parametrize(
    ("method", "theirs"), [("cat16", "CAT16"), ("von-kries", "Von Kries"), ("bradford", "Bradford")]
)
def test_each_eye_is_that_of_colour_science(method: str, theirs: str) -> None:
    image = StereoImage(picture(1), picture(2))
    shown, step = adapted(image, spec(method=method))
    whites = white_point("a", 1.0), white_point("d65", 1.0)
    for eye, before in ((shown.left, image.left), (shown.right, image.right)):
        plain = chromatic_adaptation_VonKries(before.astype(np.float64), *whites, transform=theirs)
        # One rounding to single precision of what is equal in double.
        np.testing.assert_allclose(eye, np.maximum(plain, 0), rtol=6.1e-8, atol=0)
    assert step["pixels_computed"] == 2 * 33 * 20


def test_grey_keeps_its_luminance_and_a_flat_picture_is_computed_once() -> None:
    grey = np.broadcast_to(white_point("a", 40.0), (8, 9, 3)).astype(np.float32)
    shown, step = adapted(StereoImage.flat(grey), spec())
    np.testing.assert_allclose(shown.left, np.broadcast_to(white_point("d65", 40.0), (8, 9, 3)), rtol=2e-7)
    assert shown.is_flat
    assert step["pixels_computed"] == 72


@pytest.mark.parametrize("keys", [{"degree": 0.0}, {"to_white": "a"}, {"to_white": [1.09850, 1.0, 0.35585]}])
def test_what_changes_nothing_is_not_computed(keys: dict[str, Any]) -> None:
    image = StereoImage.flat(picture())
    shown, step = adapted(image, spec(**keys))
    assert shown is image
    assert step["pixels_computed"] == 0


def test_it_comes_before_the_luminance() -> None:
    steps = StepsSpec.model_validate(
        {"adapt": {"from_white": "a", "to_white": "d65"}, "luminance": {"mean_cd_m2": 25.0}}
    )
    shown, done = finished_picture(StereoImage.flat(picture()), steps, None, 0.25, None)
    assert [step["step"] for step in done] == ["chromatic_adaptation", "adapt"]
    assert float(shown.left[..., 1].mean()) == pytest.approx(25.0, rel=1e-6)


def test_light_below_zero_is_refused_or_clipped() -> None:
    light = picture()
    light[3, 4] = light[5, 6] = [0.0, 30.0, 0.0]  # no light has it; noise in the dark does
    image = StereoImage.flat(light)
    with pytest.raises(StimulusError, match="2 pixels get negative light") as raised:
        adapted(image, spec(method="bradford"))
    assert "negative: clip" in str(raised.value)
    shown, step = adapted(image, spec(method="bradford", negative="clip"))
    assert step["clipped_pixels"] == 2
    assert float(shown.left.min()) == 0.0


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"from_white": "d56"}, "d65"),
        ({"from_white": 5}, "write a name such as d65"),
        ({"to_white": [0.3]}, "write a name such as d65"),
        ({"to_white": [0.3, 0.0]}, "no light has it"),
        ({"to_white": [0.7, 0.6]}, "no light has it"),
        ({"to_white": [0.2, 1.0, 9.0], "method": "bradford"}, "too saturated"),
        ({"degree": 1.1}, "less than or equal to 1"),
        ({"method": "cat02"}, "cat16"),
    ],
)
def test_wrong_input_is_one_message(keys: dict[str, Any], message: str) -> None:
    with pytest.raises(ValidationError) as raised:
        spec(**keys)
    errors = raised.value.errors()
    assert len(errors) == 1
    assert message in errors[0]["msg"]


def test_whites_are_stated_in_three_ways() -> None:
    image = StereoImage.flat(picture())
    white = white_point("a", 80.0)
    by_name, _ = adapted(image, spec())
    by_XYZ, _ = adapted(image, spec(from_white=white.tolist()))
    by_xy, _ = adapted(image, spec(from_white=(white[:2] / white.sum()).tolist()))
    np.testing.assert_allclose(by_XYZ.left, by_name.left, rtol=1e-6)
    np.testing.assert_allclose(by_xy.left, by_name.left, rtol=1e-6)


def test_another_observer_is_said() -> None:
    _, step = adapted(StereoImage.flat(picture()), spec(), "CIE 1964 10")
    assert "CIE 1964 10" in str(step["said"])
    assert step["from_white_XYZ"] == pytest.approx(white_point("a", 1.0, "CIE 1964 10").tolist())


# A large picture made some rows at a time is, byte for byte, the one that is made at once.

PITCH_MM = 0.2768
SCALED = "luminance: {scale: 0.7}\n"
SERIES = "series: [{name: dim, luminance_scale: 0.5}, {name: same}]\n"


@pytest.fixture
def build(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., tuple[StimulusSet, int]]:
    """Build a recipe in bands or at once, and return the set, and how many pictures were made in bands."""
    # Several bands of the small pictures here, each of one block of rows.
    monkeypatch.setattr(exr_write, "_BAND_PX", 1)
    monkeypatch.setattr(exr_write, "_BLOCK_ROWS", 16)
    saved: list[bool] = []
    save = BandedPicture.save

    def counted(picture: BandedPicture, path: Path, observer: str) -> bool:
        saved.append(save(picture, path, observer))
        return saved[-1]

    monkeypatch.setattr(BandedPicture, "save", counted)

    def make(recipe: str, least_px: int, entry: str = "") -> tuple[StimulusSet, int]:
        monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / f"cache-{least_px}"))
        monkeypatch.setattr(stimuli.recipes.banded_picture, "LEAST_PX", least_px)
        file = tmp_path / "recipe.yaml"
        plate = f"{{name: plate, file: plate.exr{entry}}}"
        file.write_text(f"schema_version: 1\nkind: pictures\nstimuli: [{plate}]\n{recipe}")
        saved.clear()
        return build_set(file, PITCH_MM), sum(saved)

    return make


def _write(path: Path, pixels: np.ndarray[Any, np.dtype[np.float32]], how: Mapping[str, Any]) -> None:
    """Write channels of one view or two."""
    names = [*"RGB", *(["right.R", "right.G", "right.B"] if pixels.shape[2] == 6 else [])]
    more = {"multiView": ("left", "right")} if pixels.shape[2] == 6 else {}
    if how.get("alpha"):
        names.append("A")
        pixels = np.concatenate([pixels, np.ones([*pixels.shape[:2], 1], np.float32)], axis=-1)
    light = {"chromaticities": how.get("primaries", (1, 0, 0, 1, 0, 0, 1 / 3, 1 / 3))}
    white = {"whiteLuminance": how["white"]} if "white" in how else {}
    attributes = {**more, **light, **white, "compression": how.get("compression", "zip")}
    window = (0, 0, pixels.shape[1] + 3, pixels.shape[0] + 2) if how.get("window") else None
    tile_px = (32, 32) if how.get("tiles") else None
    save_parts(path, [(attributes, names, pixels)], how.get("kind", "half"), display_px=window, tile_px=tile_px)


def _light(views: int) -> np.ndarray[Any, np.dtype[np.float32]]:
    light = np.random.default_rng(3).uniform(0.001, 90, (75, 61, 3 * views)).astype(np.float32)
    light[3, 4] = 0.0
    return light


REC709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)
IN_BANDS: dict[str, dict[str, Any]] = {
    "half": {},
    "float": {"kind": "float"},
    "with a white": {"white": 2.5},
    "Rec. 709": {"primaries": REC709, "white": 80.0},
    "with alpha": {"alpha": True},
    "rows in turn": {"compression": "piz"},
}
AT_ONCE: dict[str, dict[str, Any]] = {"tiles": {"tiles": True}, "a larger window": {"window": True}}


def _same(one: StimulusSet, other: StimulusSet) -> None:
    assert one.digest == other.digest
    assert one.manifest["stimuli"] == other.manifest["stimuli"]
    for name in one.names:
        assert one.path(name).read_bytes() == other.path(name).read_bytes()


@pytest.mark.parametrize(
    ("steps", "views"),
    [
        pytest.param("", 2, id="none-2", marks=pytest.mark.nightly),
        pytest.param(SCALED + SERIES, 1, id="scale and series-1"),
    ],
)
@pytest.mark.parametrize("how", [*IN_BANDS, *AT_ONCE])
def test_bands_make_the_same_file_and_manifest(
    tmp_path: Path, build: Callable[..., tuple[StimulusSet, int]], how: str, steps: str, views: int
) -> None:
    _write(tmp_path / "plate.exr", _light(views), (IN_BANDS | AT_ONCE)[how])
    banded, in_bands = build(steps, 1)
    plain, none = build(steps, 1 << 40)
    assert none == 0
    assert in_bands == (0 if how in AT_ONCE else len(plain.names))
    _same(banded, plain)


def test_our_own_exact_files_and_flat_versions(tmp_path: Path, build: Callable[..., tuple[StimulusSet, int]]) -> None:
    light = _light(2)
    write_exr(tmp_path / "plate.exr", StereoImage(light[..., :3].copy(), light[..., 3:].copy()), exact=True)
    for recipe in ("", SCALED):
        banded, in_bands = build(recipe, 1)
        plain, _ = build(recipe, 1 << 40)
        assert in_bands == 1
        _same(banded, plain)


@pytest.mark.parametrize("steps", ["", SCALED])
@pytest.mark.parametrize("value", [-1.0, float("nan"), -0.0])
def test_what_is_unusual_in_a_row_is_left_to_the_whole_picture(
    tmp_path: Path, build: Callable[..., tuple[StimulusSet, int]], value: float, steps: str
) -> None:
    light = _light(1)
    light[60, 7, 1] = value
    _write(tmp_path / "plate.exr", light, {"kind": "float"})
    found = []
    for least_px in (1, 1 << 40):
        try:
            found.append(build(steps, least_px)[0].manifest["stimuli"])
        except StimulusError as error:
            found.append(str(error).replace(f"cache-{least_px}", "cache"))
    assert found[0] == found[1]
    assert isinstance(found[0], str) == (value != 0.0)


@pytest.mark.parametrize(
    "steps", ["crop: {left_px: 1, top_px: 1, width_px: 9, height_px: 9}\n", "luminance: {mean_cd_m2: 9}\n"]
)
def test_other_steps_are_done_on_the_whole_picture(
    tmp_path: Path, build: Callable[..., tuple[StimulusSet, int]], steps: str
) -> None:
    _write(tmp_path / "plate.exr", _light(1), {})
    banded, in_bands = build(steps, 1)
    plain, _ = build(steps, 1 << 40)
    assert in_bands == 0
    _same(banded, plain)


def test_what_is_below_0_is_clipped_and_counted_as_in_the_whole(
    tmp_path: Path, build: Callable[..., tuple[StimulusSet, int]]
) -> None:
    light = _light(1)
    light[60, 7, 1] = -1.0
    _write(tmp_path / "plate.exr", light, {})
    banded, in_bands = build("", 1, ", negative: clip")
    plain, _ = build("", 1 << 40, ", negative: clip")
    assert in_bands == 0
    _same(banded, plain)
