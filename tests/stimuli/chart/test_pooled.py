"""Several photographs of charts fitted to together: repeated shots by their mean, exposures and charts side by side."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from devices.camera import Correspondences, Exposure, ReferenceColours, fit_camera
from devices.errors import DeviceError
from documents.arrays import Floats
from stimuli.chart import ChartOptions, fit_camera_to_chart
from stimuli.chart.pooled import ChartShot, pool_shots
from stimuli.develop import CameraImage, write_camera_exr
from stimuli.errors import StimulusError

MATRIX = np.array([[220.0, 37.0, 3.0], [84.0, 146.0, -46.0], [12.0, -35.0, 220.0]])
AT = Exposure(1 / 15, 8.0, 800.0)
CORNERS = ((0, 0), (120, 0), (120, 80), (0, 80))


def shot(
    reference: ReferenceColours,
    rgb: Floats,
    number: int = 0,
    noise: float = 0.0,
    at: Exposure | None = AT,
    gain: float = 1.0,
    chart: str = "chart.csv",
) -> ChartShot:
    rng = np.random.default_rng(number)
    seen = np.clip(rgb * gain + noise * rng.normal(size=rgb.shape), 0, 1)
    colours = Correspondences(seen, reference.XYZ, reference.names, seen >= 1, f"{number}.nef")
    return ChartShot(f"{number}.nef", chart, colours, at)


@pytest.fixture
def rgb(reference: ReferenceColours) -> Floats:
    return np.asarray(reference.XYZ @ np.linalg.inv(MATRIX).T)


def test_repeated_shots_are_averaged_and_show_the_noise(reference: ReferenceColours, rgb: Floats) -> None:
    pooled = pool_shots([shot(reference, rgb, number, 0.0005) for number in range(16)])
    assert len(pooled.colours) == 24
    assert (pooled.colours.rgb - rgb).std() == pytest.approx(0.0005 / 4, rel=0.25)  # of 72 values
    assert pooled.colours.noise_rgb is not None
    assert np.sqrt((pooled.colours.noise_rgb**2).mean()) == pytest.approx(0.0005 / 4, rel=0.1)
    single = fit_camera(shot(reference, rgb, 0, 0.0005).colours)
    many = fit_camera(pooled.colours)
    assert np.abs(many.model.matrix - MATRIX).max() < 0.5 * np.abs(single.model.matrix - MATRIX).max()
    (chart,) = pooled.residuals(many)
    assert chart.patches == 24
    assert len(chart.files) == 16
    assert chart.luminance_ratio == pytest.approx(1, abs=0.01)
    assert "0.nef and 15 more" in str(chart)


def test_exposures_and_charts_stand_side_by_side(reference: ReferenceColours, rgb: Floats) -> None:
    half = Exposure(1 / 30, 8.0, 800.0)
    shots = [
        shot(reference, rgb, 0),
        shot(reference, rgb, 1, at=half, gain=0.5),
        shot(reference, rgb, 2, at=half, gain=0.5, chart="other.csv"),
    ]
    pooled = pool_shots(shots)
    assert len(pooled.colours) == 72
    assert len(pooled.groups) == 3
    fit = fit_camera(pooled.colours)
    assert fit.model.exposure == half
    np.testing.assert_allclose(fit.model.matrix, 2 * MATRIX, rtol=1e-9, atol=1e-9)
    assert [chart.delta_e_max for chart in pooled.residuals(fit)] == pytest.approx([0, 0, 0], abs=1e-6)


def test_a_chart_in_other_light_shows_in_its_residual(reference: ReferenceColours, rgb: Floats) -> None:
    pooled = pool_shots([shot(reference, rgb, 0), shot(reference, rgb * 1.05, 1, chart="other.csv")])
    first, second = pooled.residuals(fit_camera(pooled.colours))
    assert first.luminance_ratio is not None
    assert second.luminance_ratio is not None
    assert second.luminance_ratio / first.luminance_ratio == pytest.approx(1.05, rel=1e-3)
    twice = pool_shots([shot(reference, rgb, 0), shot(reference, rgb * 1.08, 1)])
    assert any("1.nef has 1.080 × the light" in note for note in twice.notes)
    assert pool_shots([shot(reference, rgb, 0), shot(reference, rgb * 1.01, 1)]).notes == ()


def test_an_exposure_must_be_known_of_all_or_none(reference: ReferenceColours, rgb: Floats) -> None:
    with pytest.raises(StimulusError, match="has no exposure"):
        pool_shots([shot(reference, rgb, 0), shot(reference, rgb, 1, at=None)])
    assert len(pool_shots([shot(reference, rgb, 0, at=None), shot(reference, rgb, 1, at=None)]).colours) == 24


def photograph(path: Path, rgb: Floats, seed: int, at: Exposure | None = AT) -> Path:
    rng = np.random.default_rng(seed)
    picture = np.kron(rgb.reshape(4, 6, 3), np.ones((20, 20, 1))) + 0.002 * rng.normal(size=(80, 120, 3))
    write_camera_exr(path, CameraImage(picture.astype(np.float32), picture >= 1, at, path.name))
    return path


def test_photographs_are_read_and_pooled(tmp_path: Path, reference: ReferenceColours, rgb: Floats) -> None:
    table = tmp_path / "chart.csv"
    np.savetxt(table, reference.XYZ, delimiter=",", header="X,Y,Z", comments="")
    photos = [photograph(tmp_path / f"{number}.exr", rgb, number) for number in range(3)]
    fitted = fit_camera_to_chart(photos, ChartOptions(reference=(table,), corners_px=CORNERS))
    np.testing.assert_allclose(fitted.fit.model.matrix, MATRIX, atol=0.5)
    assert [len(chart.files) for chart in fitted.charts] == [3]
    assert fitted.to_json()["charts"][0]["files"] == ["0.exr", "1.exr", "2.exr"]
    assert "and 2 more" in fitted.fit.model.source
    by_each = fit_camera_to_chart(photos, ChartOptions(reference=(table,) * 3, corners_px=CORNERS))
    np.testing.assert_array_equal(by_each.fit.model.matrix, fitted.fit.model.matrix)
    flat = tmp_path / "flat.exr"
    write_camera_exr(
        flat, CameraImage(np.full((80, 120, 3), 0.5, np.float32), np.zeros((80, 120, 3), bool), AT, "flat")
    )
    even = fit_camera_to_chart(photos, ChartOptions(reference=(table,), corners_px=CORNERS, flat=(flat,)))
    np.testing.assert_allclose(even.fit.model.matrix, fitted.fit.model.matrix, rtol=1e-5)

    for charts, references, words in (
        ([photos[0], table], (table,), "a table is given beside other charts"),
        ([photos[0], photos[0]], (table,), "named twice"),
        (photos, (table,) * 2, "2 references are given for 3 photographs"),
        ([], (table,), "no chart"),
    ):
        with pytest.raises(StimulusError, match=words):
            fit_camera_to_chart(charts, ChartOptions(reference=references, corners_px=CORNERS))


@pytest.mark.nightly
def test_noisy_rows_count_less(reference: ReferenceColours, rgb: Floats) -> None:
    """Half of the patches with twenty times the noise: weighed by it, the matrix errs by less; alike, as without."""
    rng = np.random.default_rng(5)
    noise = np.where(np.arange(24)[:, None] % 2 == 0, 0.004, 0.0002) * np.ones(3)
    plain: list[float] = []
    weighed: list[float] = []
    for _ in range(12):
        seen = np.clip(rgb + noise * rng.normal(size=rgb.shape), 1e-4, 0.99)
        for errors, known in ((plain, None), (weighed, noise)):
            colours = Correspondences(seen, reference.XYZ, reference.names, seen > 1, noise_rgb=known)
            errors.append(float(np.sqrt(((fit_camera(colours).model.matrix - MATRIX) ** 2).mean())))
    assert np.mean(weighed) < 0.7 * np.mean(plain)
    seen = np.clip(rgb + 0.001 * rng.normal(size=rgb.shape), 1e-4, 0.99)
    even = Correspondences(seen, reference.XYZ, reference.names, seen > 1, noise_rgb=np.full((24, 3), 1e-9))
    without = Correspondences(seen, reference.XYZ, reference.names, seen > 1)
    np.testing.assert_allclose(fit_camera(even).model.matrix, fit_camera(without).model.matrix, rtol=1e-6)
    with pytest.raises(DeviceError, match="noise"):
        Correspondences(seen, reference.XYZ, reference.names, seen > 1, noise_rgb=np.zeros((3, 3)))
