"""A JPEG is kept as its own file, and what is decoded when it is loaded is what was decoded when it was built."""

from __future__ import annotations

import json
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from documents import InputError
from documents.files import sha256_of_file
from stimuli.build import StimulusSet, build_set, export_exr
from stimuli.pictures import CodedPicture, Region, read_coded
from stimuli.pictures.coded import decoded
from stimuli.pictures.colour_spaces import named_encoding
from stimuli.pictures.own_files import decoders
from stimuli.pictures.picture_pixels import decode

SIZE = (96, 64)
ENCODING = named_encoding("srgb")


@pytest.fixture(autouse=True)
def _cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / "cache"))


def scene(seed: int) -> Image.Image:
    small = np.random.default_rng(seed).integers(0, 256, (8, 12, 3), dtype=np.uint8)
    return Image.fromarray(small).resize(SIZE, Image.Resampling.BICUBIC)


def beside(one: Image.Image, other: Image.Image) -> Image.Image:
    whole = Image.new("RGB", (2 * SIZE[0], SIZE[1]))
    whole.paste(one, (0, 0))
    whole.paste(other, (SIZE[0], 0))
    return whole


def built(folder: Path, **stimulus: Any) -> StimulusSet:
    recipe = {"schema_version": 1, "kind": "pictures", "colour_space": "srgb", "white_luminance_cd_m2": 100}
    (folder / "recipe.yaml").write_text(json.dumps(recipe | {"stimuli": [{"name": "one", **stimulus}]}))
    return build_set(folder / "recipe.yaml", 0.25)


def light_of(codes: NDArray[np.uint8]) -> NDArray[np.float32]:
    return decoded(codes.reshape(*codes.shape[:2], -1), ENCODING.tables(256), ENCODING.matrix * 100)


def by_pillow(path: Path, frame: int = 0) -> NDArray[np.uint8]:
    with Image.open(path) as picture:
        picture.seek(frame)
        return np.asarray(picture)


Saved = tuple[dict[str, Any], list[NDArray[np.uint8]]]


def two_files(folder: Path) -> Saved:
    for name, seed in (("l.jpg", 1), ("r.JPEG", 2)):
        scene(seed).save(folder / name, format="JPEG", quality=90)
    return {"left": "l.jpg", "right": "r.JPEG"}, [by_pillow(folder / "l.jpg"), by_pillow(folder / "r.JPEG")]


def right_of_two(folder: Path) -> Saved:
    stimulus, eyes = two_files(folder)
    return stimulus | {"view": "flat", "flat_eye": "right"}, eyes[1:]


def turned(folder: Path) -> Saved:
    exif = Image.Exif()
    exif[0x0112] = 6
    scene(4).save(folder / "t.jpg", exif=exif)
    return {"file": "t.jpg"}, [np.rot90(by_pillow(folder / "t.jpg"), -1)]


def mpo(folder: Path) -> Saved:
    scene(5).save(folder / "m.mpo", save_all=True, append_images=[scene(6)], quality=95)
    return {"file": "m.mpo"}, [by_pillow(folder / "m.mpo"), by_pillow(folder / "m.mpo", 1)]


def jps(folder: Path) -> Saved:
    beside(scene(7), scene(8)).save(folder / "c.jps", format="JPEG")
    codes = by_pillow(folder / "c.jps")
    return {"file": "c.jps"}, [codes[:, SIZE[0] :], codes[:, : SIZE[0]]]


KINDS = [two_files, right_of_two, turned, mpo, jps]


@pytest.mark.parametrize("save", KINDS)
def test_a_loaded_jpeg_is_bit_for_bit_its_decoded_codes(tmp_path: Path, save: Callable[[Path], Saved]) -> None:
    stimulus, eyes = save(tmp_path)
    made = built(tmp_path, **stimulus)
    path = made.path("one")
    assert path.suffix == ".own"
    assert path.stat().st_size < 8_000 + sum(codes.nbytes for codes in eyes)  # the tables take 6,144
    image = made.load("one")
    assert np.array_equal(image.left, light_of(eyes[0]))
    assert np.array_equal(image.right, light_of(eyes[-1]))
    assert image.is_flat == (len(eyes) == 1)
    part = made.load("one", lambda size: Region(5, 7, size[0] // 2, size[1] // 2))
    inside = image.left[7 : 7 + image.height_px // 2, 5 : 5 + image.width_px // 2]
    # The ends of rows are multiplied in another order: the last bit of single precision.
    np.testing.assert_allclose(part.left, inside, rtol=5e-7)
    statistics = made.entry("one")["statistics"]["eyes"]["right"]
    assert statistics["max_luminance_cd_m2"] == float(image.right[..., 1].max())
    export_exr(made, tmp_path / "light")
    again = build_set(tmp_path / "light/recipe.yaml", 0.25).load("one")
    assert np.array_equal(again.right, image.right)


def test_the_files_are_kept_as_they_are(tmp_path: Path) -> None:
    stimulus, _ = two_files(tmp_path)
    path = built(tmp_path, **stimulus).path("one")
    data = path.read_bytes()
    for name in stimulus.values():
        assert (tmp_path / name).read_bytes() in data
        (tmp_path / name).unlink()
    assert read_coded(path).image().left.shape == (SIZE[1], SIZE[0], 3)


def test_other_formats_and_long_files_are_kept_as_codes(tmp_path: Path) -> None:
    """A phone's JPEG may carry a film of many megabytes behind it."""
    scene(1).save(tmp_path / "a.png")
    assert built(tmp_path, file="a.png").path("one").suffix == ".codes"
    scene(1).save(tmp_path / "b.jpg")
    with (tmp_path / "b.jpg").open("ab") as file:
        file.write(bytes(SIZE[0] * SIZE[1] * 3))
    assert built(tmp_path, file="b.jpg").path("one").suffix == ".codes"


def test_what_a_step_changes_is_kept_as_light(tmp_path: Path) -> None:
    scene(1).save(tmp_path / "a.jpg")
    assert built(tmp_path, file="a.jpg", luminance={"scale": 0.5}).path("one").suffix == ".exr"


def test_another_decoder_builds_the_pictures_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scene(1).save(tmp_path / "a.jpg")
    first = built(tmp_path, file="a.jpg")
    assert first.manifest["decoders"] == decoders()
    assert built(tmp_path, file="a.jpg").rendered == 0
    for module in ("stimuli.recipes.pictures", "stimuli.pictures.coded"):
        monkeypatch.setattr(f"{module}.decoders", lambda: {"OpenImageIO": "99", "pillow": "99"})
    second = built(tmp_path, file="a.jpg")
    assert (second.rendered, second.manifest["decoders"]["pillow"]) == (1, "99")
    # The same codes come out, so that a session with these pictures resumes.
    assert second.digest == first.digest


def test_codes_that_differ_from_those_built_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scene(1).save(tmp_path / "a.jpg")
    made = built(tmp_path, file="a.jpg")
    plain = decode

    def one_code_more(*given: Any) -> NDArray[Any]:
        codes = plain(*given).copy()
        codes[3, 5, 1] ^= 1
        return np.asarray(codes)

    monkeypatch.setattr("stimuli.pictures.own_files.decode", one_code_more)
    with pytest.raises(InputError, match=r"its files give other codes with OpenImageIO .*--force") as error:
        made.load("one")
    assert error.value.findings[0].file == str(made.path("one"))


@pytest.mark.parametrize("share", [0.0, 0.01, 0.2, 0.6, 0.99])
def test_a_cut_file_is_refused(tmp_path: Path, share: float) -> None:
    stimulus, _ = two_files(tmp_path)
    path = built(tmp_path, **stimulus).path("one")
    data = path.read_bytes()
    path.chmod(0o600)
    path.unlink()
    path.write_bytes(data[: int(share * len(data))])
    with pytest.raises(InputError, match="the picture is damaged") as error:
        read_coded(path)
    assert "/tmp" not in error.value.findings[0].message


def test_codes_written_before_own_files_were_kept_are_still_read(tmp_path: Path) -> None:
    """The layout of .codes has not changed: reports of old sessions show their pictures."""
    codes = np.random.default_rng(0).integers(0, 256, (5, 6, 3), dtype=np.uint8)
    tables = ENCODING.tables(256), ENCODING.matrix
    with (tmp_path / "a.codes").open("wb") as file:
        for array in (np.array([zlib.crc32(codes.data)], np.uint32), *tables, codes):
            np.save(file, array)
    again = read_coded(tmp_path / "a.codes")
    assert isinstance(again, CodedPicture)
    for found, written in ((again.left, codes), (again.light, tables[0]), (again.matrix, tables[1])):
        assert np.array_equal(found, written)
    assert again.save(tmp_path / "b.codes") == sha256_of_file(tmp_path / "b.codes")
    assert np.array_equal(read_coded(tmp_path / "b.codes").left, codes)


def test_a_set_without_ordinary_pictures_depends_on_no_decoder(tmp_path: Path) -> None:
    scene(1).save(tmp_path / "a.jpg")
    export_exr(built(tmp_path, file="a.jpg"), tmp_path / "light")
    assert "decoders" not in build_set(tmp_path / "light/recipe.yaml", 0.25).manifest


def test_a_picture_that_changes_while_it_is_read_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scene(1).save(tmp_path / "a.jpg")
    plain = decode

    def late(*given: Any) -> NDArray[Any]:
        codes = plain(*given)
        scene(2).save(tmp_path / "a.jpg", quality=50)
        return codes

    monkeypatch.setattr("stimuli.pictures.own_files.decode", late)
    with pytest.raises(InputError, match="changed while it was read"):
        built(tmp_path, file="a.jpg")


def test_one_table_for_three_equal_curves_is_three_tables() -> None:
    codes = np.random.default_rng(0).integers(0, 256, (33, 50, 3), dtype=np.uint8)
    light = ENCODING.tables(256)
    # Of the same curve, but for a code that does not occur in the picture.
    codes[codes == 7] = 8
    other = light.copy()
    other[7, 2] *= 2
    assert np.array_equal(decoded(codes, light, ENCODING.matrix), decoded(codes, other, ENCODING.matrix))
