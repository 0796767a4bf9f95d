"""Pictures found by their names, and files that ask for more than a picture takes, or are no files."""

from __future__ import annotations

import errno
import os
import re
import struct
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from documents import InputError
from stimuli.build import build_set
from stimuli.comparison import ReadOptions
from stimuli.comparison.pictures import read_picture as read_compared
from stimuli.develop import read_calibration, read_camera_image
from stimuli.errors import StimulusError
from stimuli.pictures import (
    FoundPicture,
    StereoImage,
    find_pictures,
    read_coded,
    read_exr,
    read_picture,
    write_exr,
)
from stimuli.pictures.exr_views import channel_runs, read_views
from stimuli.pictures.packing import eye_size_px, named_packing
from stimuli.pictures.picture_input import opened, reason, text_of
from stimuli.spectral import read_spectral
from tests.stimuli.pictures.exr_bytes import Part, floats, write_bytes
from tests.stress.picture_formats import exr_header

# Files that ask for more than a picture takes, or are no files: refused by name before memory is taken for them.

LIGHT = np.random.default_rng(5).random((20, 30, 3)).astype(np.float32)
STATED = ("chromaticities", "chromaticities", floats(0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329))


# --- only what is wanted ----------------------------------------------------------------------------------------------


@pytest.fixture
def counted(monkeypatch: pytest.MonkeyPatch) -> list[tuple[int, int]]:
    """Return the ranges of channels that are read."""
    ranges: list[tuple[int, int]] = []

    class Counting:
        def __init__(self, picture: Any) -> None:
            self._picture = picture

        def __getattr__(self, name: str) -> object:
            return getattr(self._picture, name)

        def read_scanlines(self, part: int, level: int, first: int, last: int, *more: Any) -> object:
            ranges.append((more[1], more[2]))
            return self._picture.read_scanlines(part, level, first, last, *more)

        def read_image(self, part: int, level: int, first: int, last: int, *more: Any) -> object:
            ranges.append((first, last))
            return self._picture.read_image(part, level, first, last, *more)

    import stimuli.pictures.picture_input as module

    original: Any = module._opened
    monkeypatch.setattr(module, "_opened", lambda *given: Counting(original(*given)))
    return ranges


def test_of_200_channels_the_three_of_the_picture_are_read(tmp_path: Path, counted: list[tuple[int, int]]) -> None:
    channels = {name: LIGHT[..., place] for place, name in enumerate("RGB")}
    channels |= {f"c{number:03d}": LIGHT[..., 0] for number in range(197)}
    path = write_bytes(tmp_path / "a.exr", Part(channels, [STATED]))
    whole = read_picture(path)
    assert counted == [(0, 3)]
    np.testing.assert_array_equal(read_views(path)[""].pixels, LIGHT)
    counted.clear()
    np.testing.assert_array_equal(read_camera_image(path, assume_linear=True).rgb, LIGHT)
    assert counted == [(0, 3)]
    assert whole.is_flat


def test_both_eyes_are_read_together_and_one_alone(tmp_path: Path, counted: list[tuple[int, int]]) -> None:
    write_exr(tmp_path / "a.exr", StereoImage(LIGHT, 2 * LIGHT))
    stereo = read_exr(tmp_path / "a.exr")
    assert counted == [(0, 6)]
    counted.clear()
    flat = read_exr(tmp_path / "a.exr", flat=True, flat_eye="right")
    assert counted == [(3, 6)]
    np.testing.assert_array_equal(flat.left, stereo.right)


# --- what headers ask for ---------------------------------------------------------------------------------------------


def test_what_no_picture_declares_is_named(tmp_path: Path) -> None:
    path = tmp_path / "a.exr"
    head = struct.pack("<ii", 20000630, 2)
    many = [*"RGB", *(f"c{number}" for number in range(197))]
    for header, words in (
        (exr_header((4288, 4000), many, 3) + bytes(400_000), "channels, more than|corrupt or malicious"),
        (exr_header((10_000, 10_000), "RGB", 3), "asks for 625 blocks of pixels"),
        (exr_header((100_000_000, 1), "RGB", 0), "65536 a side"),
        (b"comment\0string\0" + struct.pack("<i", 2**31 - 1), "a header 32 MB at most"),
        (b"", "cannot be read: its header is cut short"),
    ):
        path.write_bytes(head + header)
        with pytest.raises(StimulusError, match=words) as caught:
            read_picture(path)
        assert len(caught.value.findings) == 1


def test_a_picture_whose_blocks_lie_beyond_its_end_is_refused_before_it_is_read(
    tmp_path: Path, counted: list[tuple[int, int]]
) -> None:
    path = tmp_path / "a.exr"
    tall = np.repeat(LIGHT, 4, axis=0)
    write_exr(path, StereoImage(tall, 2 * tall))
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    with pytest.raises(StimulusError, match=r"\d of its 5 blocks lie beyond its end"):
        read_exr(path)
    assert counted == []


def test_a_picture_that_pillow_warns_of_is_read_without_a_warning(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.png"
    Image.new("L", (30, 20)).save(path)
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", 500)
    assert read_picture(path, "srgb", white_luminance_cd_m2=1).left.shape == (20, 30, 3)


# --- texts of libraries -----------------------------------------------------------------------------------------------


def test_an_error_that_quotes_the_file_is_one_line(tmp_path: Path) -> None:
    write_exr(tmp_path / "a.exr", StereoImage.flat(LIGHT))
    content = (tmp_path / "a.exr").read_bytes()
    (tmp_path / "a.exr").write_bytes(content.replace(b"lineOrder\0lineOrder", b"lineOrder\0\xff\xfe\xfd\xfcOrder", 1))
    for read in (read_picture, read_camera_image, read_spectral):
        with pytest.raises(InputError) as caught:
            read(tmp_path / "a.exr")
        assert all(str(finding).isprintable() for finding in caught.value.findings)


# --- no regular files, and links --------------------------------------------------------------------------------------


def _compare(path: Path) -> object:
    reading = ReadOptions(colour_space="srgb", picture_white_cd_m2=100.0)
    return read_compared(path, reading, None, "photo", lambda *_: None)


READERS: list[tuple[str, Callable[[Path], object]]] = [
    (".exr", read_picture),
    (".tif", read_picture),
    (".tif", read_camera_image),
    (".dng", read_camera_image),
    (".dng", lambda path: read_calibration(dark=[path])),
    (".exr", read_spectral),
    (".hdr", read_spectral),
    (".png", _compare),
    (".codes", read_coded),
]


@pytest.mark.skipif(sys.platform == "win32", reason="no devices in the file system")
@pytest.mark.parametrize(("suffix", "read"), READERS)
def test_devices_pipes_and_folders_are_no_pictures(tmp_path: Path, suffix: str, read: Callable[[Path], object]) -> None:
    place = tmp_path / f"a{suffix}"
    os.mkfifo(place)
    with pytest.raises(InputError, match=r"pipe|neither OpenEXR nor ENVI"):
        read(place)
    place.unlink()
    place.symlink_to("/dev/zero")
    with pytest.raises(InputError, match=r"device|neither OpenEXR nor ENVI"):
        read(place)
    place.unlink()
    place.symlink_to(place)
    with pytest.raises(InputError):
        read(place)


@pytest.fixture
def study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / "cache"))
    folder = tmp_path / "study"
    folder.mkdir()
    recipe = "schema_version: 1\nkind: pictures\nstimuli: [{name: a, file: a.exr}]\n"
    (folder / "recipe.yaml").write_text(recipe)
    write_exr(tmp_path / "elsewhere.exr", StereoImage.flat(LIGHT))
    return folder / "recipe.yaml"


@pytest.mark.parametrize(
    ("target", "words"),
    [
        (
            "../elsewhere.exr",
            r"yaml:3:\d+: 'a\.exr': this leads out of the folder .*study \(it leads to .*copy",
        ),
        ("/dev/zero", "'a.exr': this is a link to a device, not a file"),
        ("nowhere.exr", "the picture 'a.exr' cannot be read"),
    ],
)
def test_links_of_a_recipe_stay_in_its_folder(study: Path, target: str, words: str) -> None:
    (study.parent / "a.exr").symlink_to(target)
    with pytest.raises(InputError, match=words):
        build_set(study, 0.25)


def test_a_file_that_is_no_picture_is_named_with_the_reason_and_the_remedy(tmp_path: Path) -> None:
    (tmp_path / "a.exr").write_bytes(b"no picture")
    with pytest.raises(StimulusError, match="cannot be read") as caught, opened(tmp_path / "a.exr", "write it again"):
        pass
    (finding,) = caught.value.findings
    assert finding.file == str(tmp_path / "a.exr")
    assert finding.remedy == "write it again"
    assert "no reason given" not in finding.message


@pytest.mark.parametrize(
    ("message", "told"),
    [
        ("first\nsecond\n", "second"),
        ("the size is absurd\nIf that is right, raise the OIIO global attribute 'limits'.", "the size is absurd"),
        ("only a global attribute", "only a global attribute"),
        (" \n", "no reason given"),
    ],
)
def test_the_reason_is_no_advice_on_settings(message: str, told: str) -> None:
    assert reason(message) == told


def test_parts_that_are_not_shown_are_not_read(tmp_path: Path, counted: list[tuple[int, int]]) -> None:
    half = {name: LIGHT[..., place].astype("<f2") for place, name in enumerate("RGB")}
    parts = [Part(half, [STATED, ("view", "string", name)]) for name in (b"left", b"right", b"center", b"lamp")]
    path = write_bytes(tmp_path / "a.exr", *parts)
    assert not read_exr(path).is_flat
    assert len(counted) == 2
    counted.clear()
    read_exr(path, flat=True)
    assert len(counted) == 1


@pytest.mark.parametrize(
    ("groups", "runs"),
    [
        ([(0, 1, 2)], [range(3)]),
        ([(2, 0, 1)], [range(3)]),
        ([(0, 1, 2), (3, 4, 5)], [range(6)]),
        ([(0, 1, 2), (90, 91, 92)], [range(3), range(90, 93)]),
        ([(5, 5, 5)], [range(5, 6)]),
        ([(0, 3, 6)], [range(7)]),
        ([(0, 100, 200)], [range(1), range(100, 101), range(200, 201)]),
    ],
)
def test_runs_of_channels(groups: list[tuple[int, ...]], runs: list[range]) -> None:
    assert channel_runs(groups) == runs


def test_texts_of_libraries_are_one_line_of_characters() -> None:
    assert text_of(lambda: b"file \xff\xfe\x1b[31m is".decode()) == "file ��[31m is"
    assert text_of(lambda: "plain") == "plain"


def test_a_larger_file_than_any_picture_is_not_read(tmp_path: Path) -> None:
    for name in ("a.exr", "a.png", "a.tif", "a.jpg", "a.dng"):
        with (tmp_path / name).open("wb") as file:
            try:
                file.truncate(40_000_000_000)
            except OSError as error:
                pytest.skip(f"this file system has no such files: {errno.errorcode[error.errno or 0]}")
        with pytest.raises(InputError, match="larger than 8000 MB"):
            (read_camera_image if name == "a.dng" else read_picture)(tmp_path / name)
        os.truncate(tmp_path / name, 0)


def test_links_within_the_folder_and_to_it_are_followed(study: Path, tmp_path: Path) -> None:
    (study.parent / "pictures").mkdir()
    (tmp_path / "elsewhere.exr").rename(study.parent / "pictures" / "b.exr")
    (study.parent / "a.exr").symlink_to("pictures/b.exr")
    (tmp_path / "same").symlink_to(study.parent)
    assert build_set(tmp_path / "same" / "recipe.yaml", 0.25).names == ("a",)


def test_a_name_that_is_not_utf_8_is_refused(tmp_path: Path) -> None:
    path = Path(os.fsdecode(os.fsencode(tmp_path) + b"/\xff.exr"))
    try:
        path.write_bytes(b"x")
    except OSError:
        pytest.skip("this file system has no such names")
    with pytest.raises(StimulusError, match="its name is not UTF-8"), opened(path):
        pass


def test_a_set_in_the_cache_names_files_of_its_own(study: Path, tmp_path: Path) -> None:
    (tmp_path / "elsewhere.exr").rename(study.parent / "a.exr")
    built = build_set(study, 0.25)
    manifest = built.folder / "manifest.json"
    text = manifest.read_text()
    file = re.search(r'"file": "(a\.[a-z]+)"', text)
    assert file is not None
    manifest.write_text(text.replace(f'"{file[1]}"', f'"../{built.folder.name}/{file[1]}"'))
    again = build_set(study, 0.25)
    assert again.path("a").parent == again.folder
    assert ".." not in again.manifest["stimuli"][0]["file"]


# Pictures are paired by their names alone, in natural order, and what is wrong is named once and at once.
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
