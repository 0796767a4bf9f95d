"""Dark frames and flat fields: what is planted comes out again, and what does not go together is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.camera import Exposure
from stimuli.develop import read_camera_image
from stimuli.develop.calibration_frames import clipped_variance, read_calibration
from stimuli.errors import StimulusError
from tests.stimuli.develop.dng import Tag, camera_tags, exposure_tags, save_dng, save_linear_dng

HEIGHT, WIDTH, BLACK, WHITE = 60, 80, 512, 15872
SPAN = WHITE - BLACK
AT = exposure_tags((1, 8), (8, 1), 200)


def codes(light: NDArray[np.float64], pattern: NDArray[np.float64] | float = 0.0) -> NDArray[np.uint16]:
    return np.clip(np.rint(BLACK + pattern + light * SPAN), 0, 65535).astype(np.uint16)


def save(path: Path, values: NDArray[np.uint16], tags: list[Tag] | None = None) -> Path:
    return save_dng(path, values, black=(BLACK,), white=WHITE, tags=AT if tags is None else tags)


def vignette() -> NDArray[np.float64]:
    rows, columns = np.mgrid[-1 : 1 : HEIGHT * 1j, -1 : 1 : WIDTH * 1j]
    return np.asarray(1 - 0.3 * (rows**2 + columns**2))


def fixed_pattern() -> NDArray[np.float64]:
    return np.random.default_rng(3).normal(20, 6, (HEIGHT, WIDTH))


def test_dark_and_flat_are_undone(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    scene = np.kron(rng.uniform(0.2, 0.5, (6, 8)), np.ones((10, 10)))
    photo = save(tmp_path / "photo.dng", codes(scene * vignette(), fixed_pattern()))
    darks = [save(tmp_path / f"d{i}.dng", codes(np.zeros((HEIGHT, WIDTH)), fixed_pattern())) for i in range(2)]
    flats = [save(tmp_path / f"f{i}.dng", codes(0.6 * vignette(), fixed_pattern())) for i in range(2)]
    calibration = read_calibration(darks, flats)
    image = read_camera_image(photo, demosaic="superpixel", calibration=calibration)
    # of photosites whose four are in one square of the scene; the centre of the flat field is 1 by definition
    truth = scene[::2, ::2, None] * np.mean(vignette()[24:36, 32:48])
    assert np.abs(image.rgb / truth - 1).max() < 2e-3
    plain = read_camera_image(photo, demosaic="superpixel")
    assert np.abs(plain.rgb / truth - 1).max() > 0.3
    assert [step["step"] for step in image.steps] == [
        "read",
        "linearise",
        "dark",
        "flat",
        "demosaic",
        "rotate",
        "exposure",
    ]


def test_frames_are_averaged_and_their_noise_is_found(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    folder = tmp_path / "darks"
    folder.mkdir()
    zero = np.zeros((HEIGHT, WIDTH))
    for number in range(16):
        save(folder / f"{number}.dng", codes(zero, fixed_pattern() + rng.normal(0, 4, zero.shape)))
    dark = read_calibration([folder]).dark
    assert dark is not None
    assert len(dark) == 16
    off = dark.mean * SPAN - fixed_pattern()
    assert off.std() == pytest.approx(np.sqrt(4**2 + 1 / 12) / 4, rel=0.05)  # the mean of 16, with the codes' rounding
    # 15 differences of 1200 photosites a colour, each with its neighbour: 1.5 % is two standard errors
    np.testing.assert_allclose(dark.noise * SPAN, np.sqrt(4**2 + 1 / 12), rtol=0.02)


@pytest.mark.parametrize("spread", [0.3, 0.7, 3.0, 50.0])
def test_the_clipped_variance_is_that_of_normal_noise(spread: float) -> None:
    """Of whole codes too, and with a hundredth of outliers."""
    rng = np.random.default_rng(2)
    values = np.rint(rng.normal(0.37, spread, 200_000))
    truth = spread**2 + 1 / 12 if spread > 0.5 else values.var()
    assert clipped_variance(values) == pytest.approx(truth, rel=0.02)
    values[::200] += 100 * spread
    assert clipped_variance(values) == pytest.approx(truth, rel=0.04)
    assert clipped_variance(np.ones(50)) == 0


def refused(tmp_path: Path, kind: str, frame: Path) -> str:
    photo = save(tmp_path / "photo.dng", codes(np.full((HEIGHT, WIDTH), 0.3)), [*AT, *camera_tags("Acme", "Mk I")])
    with pytest.raises(StimulusError) as caught:
        read_camera_image(photo, calibration=read_calibration(**{kind: [frame]}))  # type: ignore[arg-type]
    (finding,) = caught.value.findings
    assert finding.file == str(frame)
    assert finding.remedy
    return finding.message


@pytest.mark.parametrize(
    ("tags", "kind", "words"),
    [
        (exposure_tags((1, 8), (8, 1), 400), "dark", "ISO 400, and photo.dng at ISO 200"),
        (exposure_tags((4, 1), (8, 1), 200), "dark", "taken at 4 s"),
        (exposure_tags((1, 8), (4, 1), 200), "flat", "f/4, and photo.dng at f/8"),
        ([*AT, *camera_tags("Acme", "Mk II")], "flat", "of a Acme Mk II"),
        ([*AT, *camera_tags("Acme", "Mk II")], "dark", "of a Acme Mk II"),
    ],
)
def test_frames_of_other_settings_are_refused(tmp_path: Path, tags: list[Tag], kind: str, words: str) -> None:
    light = np.full((HEIGHT, WIDTH), 0.5 if kind == "flat" else 0.0)
    assert words in refused(tmp_path, kind, save(tmp_path / "frame.dng", codes(light), tags))


def test_frames_that_cannot_be_are_refused(tmp_path: Path) -> None:
    even = np.full((HEIGHT, WIDTH), 0.5)
    assert "brighter than photo.dng" in refused(tmp_path, "dark", save(tmp_path / "a.dng", codes(even)))
    assert "saturated at" in refused(tmp_path, "flat", save(tmp_path / "b.dng", codes(even * 2.1)))
    half = even * (np.arange(WIDTH) > 8)
    assert "dark at" in refused(tmp_path, "flat", save(tmp_path / "c.dng", codes(half)))
    assert "60 × 60 photosites" in refused(tmp_path, "dark", save(tmp_path / "d.dng", codes(even[:, :60] * 0)))
    assert "pixels of R, G and B" in refused(
        tmp_path, "flat", save_linear_dng(tmp_path / "e.dng", codes(np.full((HEIGHT, WIDTH, 3), 0.5)))
    )
    unlike = [save(tmp_path / "f.dng", codes(even * 0))]
    unlike.append(save(tmp_path / "g.dng", codes(even * 0), exposure_tags((1, 4), (8, 1), 200)))
    with pytest.raises(StimulusError, match="was taken at 1/4 s"):
        read_calibration(unlike)
    (tmp_path / "empty").mkdir()
    with pytest.raises(StimulusError, match="no files"):
        read_calibration([tmp_path / "empty"])


def test_photosites_full_in_the_dark_are_marked(tmp_path: Path) -> None:
    hot = np.zeros((HEIGHT, WIDTH))
    hot[30, 40] = 1.2
    dark = save(tmp_path / "dark.dng", codes(hot))
    photo = save(tmp_path / "photo.dng", codes(np.full((HEIGHT, WIDTH), 0.3) + hot))
    image = read_camera_image(photo, demosaic="superpixel", calibration=read_calibration([dark]))
    assert image.saturated[15, 20].tolist() == [True, False, False]
    assert image.saturated.sum() == 1


def test_a_linear_dng_has_frames_too(tmp_path: Path) -> None:
    light = np.repeat(vignette()[..., None], 3, axis=-1)
    photo, flat = (
        save_linear_dng(tmp_path / f"{name}.dng", codes(share * light), black=(BLACK,) * 3, white=WHITE, tags=AT)
        for name, share in (("photo", 0.3), ("flat", 0.6))
    )
    image = read_camera_image(photo, calibration=read_calibration(flat=[flat]))
    assert np.ptp(image.rgb) < 1e-3


def test_short_dark_frames_serve_other_short_times(tmp_path: Path) -> None:
    dark = save(tmp_path / "dark.dng", codes(np.zeros((HEIGHT, WIDTH))), exposure_tags((1, 250), (8, 1), 200))
    photo = save(tmp_path / "photo.dng", codes(np.full((HEIGHT, WIDTH), 0.3)))
    image = read_camera_image(photo, calibration=read_calibration([dark]))
    assert image.exposure == Exposure(1 / 8, 8, 200)
