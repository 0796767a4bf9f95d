"""Spectral pictures: read, summed, and refused where they are made to do harm."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import colour
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from devices.camera import Exposure
from devices.readings import xyz_from_spectra
from stimuli.errors import StimulusError
from stimuli.spectral import Illumination, Quantity, read_spectral
from stimuli.spectral import picture as picture_module
from stimuli.spectral import picture as pictures
from stimuli.spectral.convert import spectral_to_camera, spectral_to_xyz
from stimuli.spectral.curves import read_illuminant, read_sensitivities
from tests.stimuli.spectral.pictures import WAVES, bumps, save_envi, save_exr

LIGHT = bumps(WAVES)


def refusal(path: Path, quantity: Quantity | None = None) -> str:
    with pytest.raises(StimulusError) as caught:
        spectral_to_xyz(read_spectral(path, quantity))
    (finding,) = caught.value.findings
    assert finding.file == str(path)
    assert finding.remedy
    return finding.message


def sensor(path: Path, waves: np.ndarray[Any, Any] = WAVES) -> Path:
    """Save the sensitivities of a sensor whose channels are no mixture of the observer's."""
    curves = [np.exp(-(((waves - centre) / 35) ** 2)) for centre in (600, 530, 460)]
    rows = ["wavelength_nm,red,green,blue"]
    rows += [f"{wave},{r:.9g},{g:.9g},{b:.9g}" for wave, r, g, b in zip(waves, *curves, strict=True)]
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize("form", ["S0.{},0nm", "S0.{}nm", "{}nm"])
@pytest.mark.parametrize("tile", [0, 4])
def test_radiance_becomes_the_xyz_of_each_spectrum(tmp_path: Path, form: str, tile: int) -> None:
    path = save_exr(tmp_path / "a.exr", LIGHT, form=form, tile=tile)
    found = spectral_to_xyz(read_spectral(path, "radiance"))
    truth = xyz_from_spectra(LIGHT.astype(np.float32).reshape(-1, len(WAVES)), WAVES).reshape(7, 9, 3)
    np.testing.assert_allclose(found.xyz, truth, rtol=1e-6)
    assert found.steps[0]["bands"] == 81


def test_channels_in_any_order_are_put_in_order(tmp_path: Path) -> None:
    """OpenEXR keeps channels by name, in which 1um comes before 380nm; other units of length are read too."""
    waves = np.concatenate([WAVES, [1000.0]])
    values = bumps(waves)
    names = [*(f"S0.{wave:g}nm" for wave in WAVES[:-1]), "S0.780e-9m", "S0.1um"]
    shuffled = np.random.default_rng(0).permutation(len(waves))
    mixed = save_exr(tmp_path / "m.exr", values[..., shuffled], names=[names[i] for i in shuffled])
    found = read_spectral(mixed)
    np.testing.assert_allclose(found.wavelengths_nm, waves)
    (block,) = found.blocks()
    np.testing.assert_array_equal(block[1], values.astype(np.float32))


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("interleave", ["bil", "bip", "bsq"])
def test_envi_gives_what_exr_gives(tmp_path: Path, interleave: str, order: str) -> None:
    header = save_envi(tmp_path / "a.hdr", LIGHT.astype(f"{order}f4"), interleave=interleave)
    truth = spectral_to_xyz(read_spectral(save_exr(tmp_path / "a.exr", LIGHT))).xyz
    for path in (header, header.with_suffix(".img")):
        np.testing.assert_allclose(spectral_to_xyz(read_spectral(path, "radiance")).xyz, truth, rtol=1e-6)


def test_envi_in_micrometres_with_bad_bands_and_a_scale(tmp_path: Path) -> None:
    waves = np.concatenate([WAVES, [2000.0, 2500.0]])
    codes = np.rint(bumps(waves) * 10000).astype(np.uint16)
    codes[..., -1] = 65535
    codes[..., 40] = 60000
    told = {
        "wavelength units": "Micrometers",
        "wavelength": [f"{wave / 1000:g}" for wave in waves],
        "reflectance scale factor": 10000,
        "bbl": [0 if index in (40, 82) else 1 for index in range(83)],
    }
    picture = read_spectral(save_envi(tmp_path / "a.hdr", codes, waves, **told))
    assert picture.quantity == "reflectance"
    assert picture.notes == ("2 bands marked bad in the header were left out",)
    found = spectral_to_xyz(picture, Illumination("E", 100.0)).xyz
    plain = codes[..., np.delete(np.arange(81), 40)] / 10000
    save_exr(tmp_path / "b.exr", plain, np.delete(WAVES, 40), "T.{},0nm")
    np.testing.assert_allclose(
        found, spectral_to_xyz(read_spectral(tmp_path / "b.exr"), Illumination("E", 100.0)).xyz, rtol=1e-5
    )


@pytest.mark.parametrize("name", ["D65", "A"])
def test_reflectance_in_a_light(tmp_path: Path, name: str) -> None:
    """A perfect diffuser has the light's own colour and the luminance asked for."""
    reflectance = np.ones((2, 3, len(WAVES)))
    reflectance[1] = 0.18
    picture = read_spectral(save_exr(tmp_path / "a.exr", reflectance, form="T.{},0nm"))
    xyz = spectral_to_xyz(picture, Illumination(name, 80.0)).xyz
    np.testing.assert_allclose(xyz[0, :, 1], 80.0, rtol=1e-6)
    np.testing.assert_allclose(xyz[1], 0.18 * xyz[0], rtol=1e-6)
    white = colour.CCS_ILLUMINANTS["CIE 1931 2 Degree Standard Observer"][name]
    np.testing.assert_allclose(xyz[0, 0, :2] / xyz[0, 0].sum(), white, atol=3e-4)


def test_an_illuminant_of_a_file_is_irradiance(tmp_path: Path) -> None:
    (tmp_path / "light.csv").write_text("wavelength_nm,value\n360,0.01\n830,0.01\n", encoding="utf-8")
    picture = read_spectral(save_exr(tmp_path / "a.exr", np.ones((2, 3, 81)), form="{}nm"), "reflectance")
    found = spectral_to_xyz(picture, Illumination(str(tmp_path / "light.csv"))).xyz
    truth = xyz_from_spectra(np.full((1, 81), 0.01 / np.pi), WAVES)
    np.testing.assert_allclose(found[0, 0], truth[0], rtol=1e-6)
    double = spectral_to_xyz(picture, Illumination(str(tmp_path / "light.csv"), scale=2.0)).xyz
    np.testing.assert_allclose(double, 2 * found, rtol=1e-6)


def test_the_camera_s_numbers(tmp_path: Path) -> None:
    """Equal-energy light of the full-scale luminance just fills the first channel; twice as much is held at 1."""
    flat = np.ones((1, 3, 81)) * np.array([0.5, 1.0, 2.0])[None, :, None]
    picture = read_spectral(save_exr(tmp_path / "a.exr", flat))
    luminance = float(spectral_to_xyz(picture).xyz[0, 1, 1])
    image = spectral_to_camera(picture, sensor(tmp_path / "s.csv"), luminance * 1.0001, exposure=Exposure(0.1, 8))
    np.testing.assert_allclose(image.rgb[0, 1].max(), 1.0, rtol=2e-4)
    np.testing.assert_allclose(image.rgb[0, 0], image.rgb[0, 1] / 2, rtol=1e-6)
    assert (image.rgb[0, 2] == 1).all()
    assert image.saturated[0].tolist() == [[False] * 3, [False] * 3, [True] * 3]
    assert image.exposure == Exposure(0.1, 8)


@settings(max_examples=8, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(step=st.integers(1, 20), low=st.integers(360, 400), rows=st.integers(1, 5), seed=st.integers(0, 99))
def test_blocks_change_nothing(tmp_path: Path, step: int, low: int, rows: int, seed: int) -> None:
    """Whatever the spacing and the block, it is the sum over the whole picture."""
    waves = np.arange(low, 730.0 + step, step)
    values = bumps(waves, (7, 3), seed)
    path = save_exr(tmp_path / "blocks.exr", values, waves, "{}nm", tile=0)
    whole = spectral_to_xyz(read_spectral(path, "radiance")).xyz
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(picture_module, "_BLOCK_VALUES", rows * 3 * len(waves))
        picture = read_spectral(path, "radiance")
        object.__setattr__(picture, "chunk_rows", 1)
        assert len(list(picture.blocks())) == -(-7 // rows)
        np.testing.assert_array_equal(spectral_to_xyz(picture).xyz, whole)
    np.testing.assert_allclose(whole, xyz_from_spectra(values.reshape(-1, len(waves)), waves).reshape(7, 3, 3), 2e-6)


def test_negative_light_is_refused_or_counted(tmp_path: Path) -> None:
    values = LIGHT.copy()
    values[2, 3] = -0.01
    path = save_exr(tmp_path / "a.exr", values)
    assert "1 pixel has negative XYZ" in refusal(path)
    found = spectral_to_xyz(read_spectral(path), negative="clip")
    assert found.clipped == 1
    assert found.lowest < 0
    assert found.xyz.min() == 0


def test_exr_files_that_are_none_are_refused(tmp_path: Path) -> None:
    rgb = save_exr(tmp_path / "rgb.exr", np.ones((2, 2, 3)), names=["R", "G", "B"])
    assert "no channel is named like" in refusal(rgb)
    three = save_exr(tmp_path / "three.exr", np.ones((2, 2, 3)), np.array([450.0, 550.0, 650.0]))
    assert "3 bands" in refusal(three)
    narrow = WAVES[(WAVES >= 410)]
    told = refusal(save_exr(tmp_path / "n.exr", np.ones((2, 2, len(narrow))), narrow))
    assert told.count("410..780 nm") == 1
    wide = np.arange(380.0, 781.0, 25.0)
    far = np.concatenate([WAVES[WAVES < 695], [900.0]])
    assert "sees over 380..690 nm" in refusal(save_exr(tmp_path / "o.exr", np.ones((2, 2, len(far))), far))
    assert "no band" in refusal(save_exr(tmp_path / "w.exr", np.ones((2, 2, len(wide))), wide))
    names = [f"S0.{wave:g},0nm" for wave in WAVES]
    names[1] = "S0.380nm"
    assert "do not rise: 380 nm, then 380 nm" in refusal(save_exr(tmp_path / "d.exr", LIGHT, names=names))
    plain = save_exr(tmp_path / "p.exr", LIGHT, form="{}nm")
    assert "radiance or reflectance" in refusal(plain)
    assert "S0.550nm" in refusal(save_exr(tmp_path / "t.exr", LIGHT, form="T.{},0nm"), "radiance")
    assert "no light falls" in refusal(tmp_path / "t.exr")
    both = np.concatenate([LIGHT, LIGHT], axis=2)
    either = [f"{kind}.{wave:g}nm" for kind in ("S0", "T") for wave in WAVES]
    assert "S0 and T" in refusal(save_exr(tmp_path / "b.exr", both, names=either))
    bispectral = ["T.400nm.500nm", *(f"T.{wave:g}nm" for wave in WAVES[1:])]
    assert "bispectral" in refusal(save_exr(tmp_path / "f.exr", LIGHT, names=bispectral))


def test_what_is_not_finite_or_whole_is_refused(tmp_path: Path) -> None:
    values = LIGHT.copy()
    values[4, 4, 3] = np.nan
    values[5, 4, 3] = np.inf
    assert "2 pixels are NaN or infinite" in refusal(save_exr(tmp_path / "a.exr", values))
    assert "2 pixels are NaN" in refusal(save_envi(tmp_path / "a.hdr", values.astype(np.float32)), "radiance")
    whole = save_exr(tmp_path / "b.exr", LIGHT)
    content = whole.read_bytes()
    whole.write_bytes(content[: len(content) * 2 // 3])
    assert "cut short" in refusal(whole)
    assert "no such file" in refusal(tmp_path / "missing.exr")
    (tmp_path / "odd.bin").write_bytes(b"abc")
    assert "neither OpenEXR nor ENVI" in refusal(tmp_path / "odd.bin")


def test_envi_files_that_are_none_are_refused(tmp_path: Path) -> None:
    values = LIGHT.astype(np.float32)

    def save(**told: Any) -> Path:
        return save_envi(tmp_path / "a.hdr", values, **told)

    assert "radiance or reflectance" in refusal(save())
    assert "lists no wavelengths" in refusal(save(wavelength=None), "radiance")
    assert "unit of its wavelengths is ''" in refusal(save(**{"wavelength units": None}), "radiance")
    assert "80 wavelengths for 81 bands" in refusal(save(wavelength=list(WAVES[1:])), "radiance")
    assert "do not rise: 780 nm" in refusal(save(wavelength=list(WAVES[::-1])), "radiance")
    assert "holds no data" in refusal(save(**{"data ignore value": float(values[0, 0, 0])}), "radiance")
    header = save()
    text = header.read_text(encoding="utf-8")
    for line, words in (("interleave = bil", "interleave is 'bix'"), ("lines = 7", "lines")):
        header.write_text(text.replace(line, line[:-1] + ("x" if line[-1] == "l" else "0")), encoding="utf-8")
        assert words in refusal(header, "radiance")
    data = save().with_suffix(".img")
    data.write_bytes(data.read_bytes()[:-1])
    assert "cut short" in refusal(tmp_path / "a.hdr", "radiance")
    (tmp_path / "a.hdr").write_bytes(b"ENVI\nsamples = many\n")
    assert "cannot be read" in refusal(tmp_path / "a.hdr", "radiance")


def test_the_light_and_the_picture_go_together(tmp_path: Path) -> None:
    radiance = read_spectral(save_exr(tmp_path / "s.exr", LIGHT))
    with pytest.raises(StimulusError, match="has its light in it"):
        spectral_to_xyz(radiance, Illumination("D65"))
    reflectance = read_spectral(save_exr(tmp_path / "t.exr", LIGHT, form="T.{},0nm"))
    with pytest.raises(StimulusError, match="no illuminant 'D99'"):
        spectral_to_xyz(reflectance, Illumination("D99"))
    for white, scale in ((None, 0.0), (None, np.nan), (-1.0, 1.0)):
        with pytest.raises(StimulusError, match="above 0"):
            Illumination(None, white, scale)
    with pytest.raises(StimulusError, match="full scale is at 0"):
        spectral_to_camera(radiance, sensor(tmp_path / "s.csv"), 0.0)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("wavelength,red,green,blue\n", "header has no wavelength_nm"),
        ("wavelength_nm,red,green,blue\n", "has no rows"),
        ("wavelength_nm,red,green,blue\n400,1,1,1\n690,1,1,1\n", "400..690 nm"),
        ("wavelength_nm,red,green,blue\n400,1,1,x\n", "blue is 'x'"),
        ("wavelength_nm,red,green,blue\n400,1,-1,1\n", "green is '-1'"),
        ("wavelength_nm,red,green,blue\n380,1,0,1\n780,1,0,1\n", "green sees nothing"),
    ],
)
def test_sensitivities_that_cannot_be(tmp_path: Path, text: str, words: str) -> None:
    (tmp_path / "s.csv").write_text(text, encoding="utf-8")
    picture = read_spectral(save_exr(tmp_path / "a.exr", LIGHT))
    with pytest.raises(StimulusError, match=words) as caught:
        spectral_to_camera(picture, tmp_path / "s.csv", 100.0)
    assert caught.value.findings[0].file == str(tmp_path / "s.csv")


def test_the_sum_is_colour_science_s(tmp_path: Path) -> None:
    path = save_exr(tmp_path / "a.exr", LIGHT)
    found = spectral_to_xyz(read_spectral(path)).xyz
    for row, column in ((0, 0), (3, 5), (6, 8)):
        spectrum = colour.SpectralDistribution(LIGHT[row, column].astype(np.float32), WAVES)
        cmfs = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"].copy().align(spectrum.shape)
        truth = 683 * 5 * (spectrum.values[:, None] * cmfs.values).sum(axis=0)
        np.testing.assert_allclose(found[row, column], truth, rtol=1e-6)


def test_the_camera_s_bands_are_as_wide_as_they_lie_apart(tmp_path: Path) -> None:
    """Each band counts for half the way to either neighbour, as the observer's do."""
    waves = np.sort(np.random.default_rng(3).uniform(380, 780, 120))
    waves[[0, -1]] = 380, 780
    slope = np.stack([np.ones(120), (waves - 300) / 400])[None]
    (tmp_path / "s.csv").write_text("wavelength_nm,red,green,blue\n380,1,2,3\n780,3,2,1\n", encoding="utf-8")
    picture = read_spectral(save_exr(tmp_path / "a.exr", slope, names=[f"S0.{wave:.9f}nm" for wave in waves]))
    rgb = spectral_to_camera(picture, tmp_path / "s.csv", 1e7).rgb[0]
    curves = np.stack([np.interp(waves, [380, 780], ends) for ends in ((1, 3), (2, 2), (3, 1))], axis=1)
    width = np.empty(120)
    width[1:-1], width[0], width[-1] = (waves[2:] - waves[:-2]) / 2, waves[1] - waves[0], waves[-1] - waves[-2]
    sums = [(slope[0, index][:, None] * curves * width[:, None]).sum(axis=0) for index in (0, 1)]
    np.testing.assert_allclose(rgb[1] / rgb[0], sums[1] / sums[0], rtol=1e-5)


def test_the_camera_sees_light_on_reflectance(tmp_path: Path) -> None:
    reflectance = bumps(WAVES, (2, 2))
    direct = reflectance * colour.SDS_ILLUMINANTS["A"].copy().align(colour.SpectralShape(380, 780, 5)).values / np.pi
    one = read_spectral(save_exr(tmp_path / "r.exr", reflectance, form="T.{},0nm"))
    other = read_spectral(save_exr(tmp_path / "s.exr", direct))
    curves = sensor(tmp_path / "s.csv")
    np.testing.assert_allclose(
        spectral_to_camera(one, curves, 1e6, Illumination("A")).rgb,
        spectral_to_camera(other, curves, 1e6).rgb,
        rtol=1e-5,
    )


# Spectral pictures, curves and numbers made to do harm.

HOSTILE_WAVES = np.arange(400.0, 710.0, 10.0)
LISTED = "wavelength = {" + ", ".join(f"{wave:g}" for wave in HOSTILE_WAVES) + "}\nwavelength units = Nanometers\n"
HEAD = "wavelength_nm,red,green,blue\n"


def envi(folder: Path, more: str = "", **changed: object) -> Path:
    keys = {"samples": 8, "lines": 8, "bands": 31, "header offset": 0, "data type": 4, "interleave": "bsq"}
    keys |= {key.replace("_", " "): one for key, one in changed.items()}
    text = "".join(f"{key} = {one}\n" for key, one in keys.items())
    path = folder / "a.hdr"
    path.write_text(f"ENVI\n{text}file type = ENVI Standard\nbyte order = 0\n{LISTED}{more}", encoding="utf-8")
    (folder / "a.img").write_bytes(np.full(8 * 8 * 31, 0.5, np.float32).tobytes())
    return path


def told(error: pytest.ExceptionInfo[StimulusError]) -> str:
    (finding,) = error.value.findings
    text = str(finding)
    assert text.isprintable()
    assert len(text) < 1500
    return text


@pytest.mark.parametrize(
    ("changed", "more", "reason"),
    [
        ({"samples": 10**9, "lines": 10**9}, "", "cut short"),
        ({"lines": "9" * 30}, "", "a.hdr: "),
        ({"header_offset": "9" * 400}, "", "cut short"),
        ({"bands": 0}, "", "0 bands"),
        ({"samples": -8, "lines": -8}, "", "-8 samples"),
        ({}, "data ignore value = {1, 2}\n", "its data ignore value is"),
        ({}, "reflectance scale factor = nan\n", "scale factor is nan"),
        ({}, "description = {" + "x" * 1_100_000 + "}\n", "its header is larger than 1000 kB"),
        ({"interleave": "\u202e<b>\x1b[2J"}, "", "its interleave is"),
    ],
)
def test_headers_that_lie_are_refused(tmp_path: Path, changed: dict[str, object], more: str, reason: str) -> None:
    began_s = time.process_time()
    with pytest.raises(StimulusError) as caught:
        spectral_to_xyz(read_spectral(envi(tmp_path, more, **changed), "radiance"))
    assert reason in told(caught)
    assert time.process_time() - began_s < 5


def test_rows_that_fill_the_memory_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = envi(tmp_path)
    monkeypatch.setattr(pictures, "MAX_CHUNK_VALUES", 8 * 31)
    assert spectral_to_xyz(read_spectral(path, "radiance")).xyz.shape == (8, 8, 3)
    monkeypatch.setattr(pictures, "MAX_CHUNK_VALUES", 8 * 31 - 1)
    with pytest.raises(StimulusError, match="more than 247 values"):
        read_spectral(path, "radiance")


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (HEAD + "400,1e308,1,1\n700,1,1,1\n", "s.csv:2:2: red is '1e308' (a number in 0..1e+30"),
        (HEAD + "400,nan,1,1\n", "s.csv:2:2: red is 'nan'"),
        ("wavelength_nm,red,red,green,blue\n400,1,2,1,1\n700,1,1,1,1\n", "the column 'red' stands twice"),
        (HEAD + "\u202e<b>\x1b[2J" + "y" * 100_000 + ",1,1,1\n", "s.csv:2:1: wavelength_nm is '<b>[2Jyyy"),
        (HEAD + '"' + "400,1,1,1\n" * 100_000, "not CSV"),
        (HEAD + "".join(f"{400 + number / 1e4:.4f},1,1,1\n" for number in range(150_000)), "larger than 2 MB"),
    ],
)
def test_curves_that_do_harm_are_refused(tmp_path: Path, text: str, reason: str) -> None:
    path = tmp_path / "s.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(StimulusError) as caught:
        read_sensitivities(path, HOSTILE_WAVES)
    assert reason in told(caught)


@pytest.mark.parametrize("number", [1e-300, 1e300, float("nan"), 0.0])
def test_absurd_numbers_are_refused(tmp_path: Path, number: float) -> None:
    with pytest.raises(StimulusError, match="'scale' is"):
        Illumination(scale=number)
    with pytest.raises(StimulusError, match="'white_luminance_cd_m2' is"):
        Illumination("D65", number)
    sensor = tmp_path / "s.csv"
    sensor.write_text(HEAD + "400,1,1,1\n700,1,1,1\n", encoding="utf-8")
    with pytest.raises(StimulusError, match="full scale is at"):
        spectral_to_camera(read_spectral(envi(tmp_path), "radiance"), sensor, number)


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="this system has no file without an end")
def test_a_curve_without_an_end_is_not_read(tmp_path: Path) -> None:
    (tmp_path / "endless.csv").symlink_to("/dev/zero")
    with pytest.raises(StimulusError, match="this is a link to a device"):
        read_illuminant(str(tmp_path / "endless.csv"), HOSTILE_WAVES)
