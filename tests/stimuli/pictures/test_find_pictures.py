"""Pictures are paired by their names alone, in natural order, and what is wrong is named once and at once."""

from __future__ import annotations

import struct
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from documents import InputError
from stimuli.pictures import FoundPicture, find_pictures
from stimuli.pictures.packing import eye_size_px, named_packing


def save(path: Path, size: tuple[int, int] = (8, 6), **more: object) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.new("RGB", size, (120, 60, 30)).save(path, **more)  # type: ignore[arg-type]  # options of any format
    return path


def listed(*paths: Path) -> dict[str, FoundPicture]:
    return {picture.name: picture for picture in find_pictures(paths)}


@pytest.mark.parametrize(
    ("left", "right", "name"),
    [
        ("plate_L.png", "plate_R.jpg", "plate"),
        ("plate-l.png", "plate-r.png", "plate"),
        ("plate left.tif", "plate right.tif", "plate"),
        ("Left_plate.png", "Right_plate.png", "plate"),
        ("img_left_007.webp", "img_right_007.webp", "img_007"),
        ("left/a.png", "right/a.jpg", "a"),
        ("Left/a_L.png", "Right/a_R.png", "a"),
        ("scene/left.png", "scene/right.png", "scene"),
    ],
)
def test_pairs(tmp_path: Path, left: str, right: str, name: str) -> None:
    files = save(tmp_path / left), save(tmp_path / right)
    folder = tmp_path / "scene" if name == "scene" else tmp_path
    (found,) = find_pictures([folder])
    assert (found.left, found.right, found.file) == (*files, None)
    assert (found.name, found.stereo, found.size_px, found.packing) == (name, True, (8, 6), None)


def test_natural_order_and_flat_pictures(tmp_path: Path) -> None:
    for number in (10, 2, 1):
        save(tmp_path / f"plate{number}_L.png")
        save(tmp_path / f"plate{number}_R.png")
    save(tmp_path / "right.png").rename(tmp_path / "Vase blue!.png")
    (tmp_path / "notes.txt").write_text("no picture", encoding="utf-8")
    found = find_pictures([tmp_path])
    assert [picture.name for picture in found] == ["plate1", "plate2", "plate10", "Vase-blue"]
    assert not found[-1].stereo
    assert found[-1].file == tmp_path / "Vase blue!.png"


@pytest.mark.parametrize(
    ("stem", "packing", "size"),
    [
        ("a_sbs", "side-by-side", (4, 6)),
        ("a_hsbs", "side-by-side-half", (8, 6)),
        ("a_crossed", "side-by-side-crossed", (4, 6)),
        ("a-HSBS-crossed", "side-by-side-half-crossed", (8, 6)),
        ("a_ou", "top-bottom", (8, 3)),
        ("a_hou", "top-bottom-half", (8, 6)),
        ("sbs", None, (8, 6)),
        ("a_sbs_ou", None, (8, 6)),
        ("absbs", None, (8, 6)),
        ("a_half", None, (8, 6)),
    ],
)
def test_packing_by_name(tmp_path: Path, stem: str, packing: str | None, size: tuple[int, int]) -> None:
    assert named_packing(stem) == packing
    (found,) = find_pictures([save(tmp_path / f"{stem}.png")])
    assert (found.packing, found.size_px, found.stereo) == (packing, size, packing is not None)
    if packing:
        assert found.name == "a"


def test_mpo_and_jps(tmp_path: Path) -> None:
    first, second = Image.new("RGB", (8, 6), "red"), Image.new("RGB", (8, 6), "blue")
    first.save(tmp_path / "a.mpo", save_all=True, append_images=[second])
    first.save(tmp_path / "b.mpo", save_all=True, append_images=[second.resize((4, 3))])  # a preview
    save(tmp_path / "c.jps", format="JPEG")
    found = listed(tmp_path)
    assert (found["a"].stereo, found["a"].packing, found["a"].size_px) == (True, None, (8, 6))
    assert not found["b"].stereo
    assert (found["c"].packing, found["c"].size_px) == ("side-by-side-crossed", (4, 6))


@pytest.mark.parametrize(
    ("flags", "layout", "packing"),
    [
        (0x04, 2, "side-by-side"),
        (0x00, 2, "side-by-side-crossed"),
        (0x06, 2, "side-by-side-half"),
        (0x05, 3, "top-bottom-half"),
        (0x00, 3, "top-bottom-crossed"),
    ],
)
def test_the_descriptor_of_a_jps(tmp_path: Path, flags: int, layout: int, packing: str) -> None:
    data = save(tmp_path / "a.jpg").read_bytes()
    body = b"_JPSJPS_" + bytes([0, 4, 0, flags, layout, 1])
    (tmp_path / "a.jps").write_bytes(data[:2] + b"\xff\xe3" + (len(body) + 2).to_bytes(2, "big") + body + data[2:])
    assert listed(tmp_path / "a.jps")["a"].packing == packing


def complaint(*paths: Path) -> str:
    with pytest.raises(InputError) as error:
        find_pictures(paths)
    return str(error.value)


def test_what_is_wrong(tmp_path: Path) -> None:
    save(tmp_path / "alone" / "a_L.png")
    assert "without the right eye's" in complaint(tmp_path / "alone")
    save(tmp_path / "sizes" / "a_L.png")
    save(tmp_path / "sizes" / "a_R.png", (8, 7))
    assert "the right eye's 8 × 7" in complaint(tmp_path / "sizes")
    (tmp_path / "empty").mkdir()
    assert "no pictures" in complaint(tmp_path / "empty")
    save(tmp_path / "case" / "Plate.png")
    save(tmp_path / "case" / "plate.jpg")
    assert "2 files give one name" in complaint(tmp_path / "case")
    save(tmp_path / "twice" / "a_L.png")
    save(tmp_path / "twice" / "a_L.jpg")
    save(tmp_path / "twice" / "a_R.jpg")
    assert "a_L.jpg and a_L.png" in complaint(tmp_path / "twice")
    assert "no such picture" in complaint(tmp_path / "missing.png")
    save(tmp_path / "odd_sbs.png", (9, 6))
    assert "9 columns cannot be divided" in complaint(tmp_path / "odd_sbs.png")


def test_all_that_is_wrong_at_once(tmp_path: Path) -> None:
    save(tmp_path / "a_L.png")
    save(tmp_path / "b_R.png")
    (tmp_path / "c.gif").write_bytes(b"GIF89a")
    with pytest.raises(InputError) as error:
        find_pictures([tmp_path])
    assert len(error.value.findings) == 3


def test_a_preview_in_an_mpo_is_no_second_eye(tmp_path: Path) -> None:
    """Cameras that take one picture put a large preview into the same file, and say so by its type."""
    first, second = Image.new("RGB", (8, 6), "red"), Image.new("RGB", (8, 6), "blue")
    first.save(tmp_path / "a.mpo", save_all=True, append_images=[second])
    data = (tmp_path / "a.mpo").read_bytes()
    entries = data.index(struct.pack("<L", 0x030000))  # the first picture's type, 16 bytes before the second's
    preview = struct.pack("<L", 0x010002)
    (tmp_path / "b.mpo").write_bytes(data[: entries + 16] + preview + data[entries + 20 :])
    found = listed(tmp_path)
    assert found["a"].stereo
    assert not found["b"].stereo


def test_declared_colour_spaces(tmp_path: Path) -> None:
    from PIL import ImageCms
    from PIL.PngImagePlugin import PngInfo

    srgb = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    save(tmp_path / "profile.jpg", icc_profile=srgb)
    save(tmp_path / "nothing.png")
    chunk = PngInfo()
    chunk.add(b"sRGB", b"\0")
    save(tmp_path / "chunk.png", pnginfo=chunk)
    exif = Image.Exif()
    exif.get_ifd(0x8769)[0xA001] = 1
    exif[0x8769] = {0xA001: 1}
    save(tmp_path / "exif.jpg", exif=exif)
    found = listed(tmp_path)
    spaces = {name: picture.colour_space for name, picture in found.items()}
    assert spaces == {"profile": "srgb", "nothing": None, "chunk": "srgb", "exif": "srgb"}


def test_exif_orientation_turns_the_size(tmp_path: Path) -> None:
    exif = Image.Exif()
    exif[0x0112] = 6
    assert listed(save(tmp_path / "a.jpg", exif=exif))["a"].size_px == (6, 8)


@pytest.mark.skipif(not Path("/proc").exists(), reason="file names that differ in case alone need such a file system")
def test_names_that_differ_in_case_alone(tmp_path: Path) -> None:
    save(tmp_path / "Plate.png")
    save(tmp_path / "plate.png")
    assert "2 files differ in upper and lower case alone, 'Plate'" in complaint(tmp_path)


def test_nothing_is_decoded(tmp_path: Path) -> None:
    """The pixels of 60 pictures of 12 megapixels would take 12 s to decode."""
    noise = np.random.default_rng(1).integers(0, 255, (300, 400, 3), np.uint8)
    Image.fromarray(noise).resize((4000, 3000)).save(tmp_path / "p1_L.jpg", quality=60)
    data = (tmp_path / "p1_L.jpg").read_bytes()
    for number in range(1, 31):
        for eye in "LR":
            (tmp_path / f"p{number}_{eye}.jpg").write_bytes(data)
    began = time.perf_counter()
    assert len(find_pictures([tmp_path])) == 30
    assert time.perf_counter() - began < 2.0


def test_sizes_of_packed_pictures() -> None:
    assert eye_size_px((100, 40), "side-by-side", Path("a.png")) == (50, 40)
    assert eye_size_px((100, 40), "top-bottom-half-crossed", Path("a.png")) == (100, 40)
