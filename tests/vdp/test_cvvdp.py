"""ColorVideoVDP for real: against its own command on the same pictures, and how it falls with a fault."""

from __future__ import annotations

import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from stimuli.measures import ViewingConditions, measure_pictures

pytestmark = [
    pytest.mark.vdp,
    pytest.mark.filterwarnings("ignore"),  # of old code in its dependencies
    pytest.mark.skipif(find_spec("pycvvdp") is None, reason="the package cvvdp is not here: make test-vdp installs it"),
]

VIEWING = ViewingConditions(45.0, np.array([95.0, 100.0, 108.9]))


def picture(seed: int = 1) -> NDArray[np.float32]:
    """Patches of colour with edges, of 5 to 90 cd/m²."""
    blocks = np.random.default_rng(seed).uniform(5.0, 90.0, (12, 16, 1)) * [0.95, 1.0, 1.09]
    return np.asarray(np.kron(blocks, np.ones((10, 10, 1))), dtype=np.float32)


def quality(reference: NDArray[np.float32], test: NDArray[np.float32], viewing: ViewingConditions = VIEWING) -> float:
    return measure_pictures(reference, test, ["cvvdp"], viewing)["cvvdp"].eyes["both"].value


def test_identical_pictures_have_ten() -> None:
    found = measure_pictures(picture(), picture(), ["cvvdp"], VIEWING)["cvvdp"].eyes["both"]
    assert found.value == pytest.approx(10.0, abs=1e-6)
    assert found.error_map is not None
    assert found.error_map.shape == (120, 160)
    assert float(np.abs(found.error_map).max()) == pytest.approx(0.0, abs=1e-3)


def test_it_falls_with_blur() -> None:
    sharp = picture()
    blurred = [gaussian_filter(sharp, (sd, sd, 0)) for sd in (0.5, 1.0, 2.0, 4.0)]
    qualities = [quality(sharp, one) for one in blurred]
    assert all(np.diff([10.0, *qualities]) < -0.05)


def test_a_fault_is_seen_where_it_is_and_less_from_afar() -> None:
    spoilt = picture()
    spoilt[30:60, 100:130] *= 1.3
    found = measure_pictures(picture(), spoilt, ["cvvdp"], VIEWING)["cvvdp"].eyes["both"]
    assert found.error_map is not None
    assert found.error_map[30:60, 100:130].mean() > 10 * found.error_map[:, :60].mean()
    fine = picture()
    fine *= 1 + 0.2 * (-1.0) ** np.indices(fine.shape[:2]).sum(axis=0)[..., None]
    values = [quality(picture(), fine.astype(np.float32), ViewingConditions(ppd)) for ppd in (10.0, 45.0, 120.0)]
    assert values[0] < values[1] < values[2]


def test_against_its_own_command(tmp_path: Path) -> None:
    """The same light in OpenEXR, and a display of our own in its configuration file: 1e-4 JOD."""
    import json

    import pyexr
    from pycvvdp import utils

    spaces = json.loads(Path(utils.config_files.find("color_spaces.json", [])).read_text(encoding="utf-8"))
    space = spaces["BT.709-linear"]
    matrix = np.linalg.inv([space["RGB2X"], space["RGB2Y"], space["RGB2Z"]])
    pictures = {"reference": picture(), "test": gaussian_filter(picture(), (1.5, 1.5, 0))}
    for name, XYZ in pictures.items():
        pyexr.write(str(tmp_path / f"{name}.exr"), (XYZ.astype(np.float64) @ matrix.T).astype(np.float32))
    display = {
        "name": "absolute light",
        "max_luminance": 10000,
        "min_luminance": 0.005,
        "colorspace": "BT.709-linear",
        "resolution": [160, 120],
        "pixels_per_degree": 45.0,
        "E_ambient": 0,
    }
    (tmp_path / "display_models.json").write_text(json.dumps({"ours": display}), encoding="utf-8")
    command = [sys.executable, "-m", "pycvvdp.run_cvvdp", "--device", "cpu", "--quiet", "--display", "ours"]
    command += ["--config-paths", str(tmp_path / "display_models.json")]
    command += ["-t", str(tmp_path / "test.exr"), "-r", str(tmp_path / "reference.exr")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=240, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    theirs = float(done.stdout.split("=")[-1].split()[0])
    # The command prints four decimals.
    assert quality(pictures["reference"], pictures["test"]) == pytest.approx(theirs, abs=1e-4)


def test_light_out_of_its_range_is_said() -> None:
    dark = picture()
    dark[:12] = 0.0
    found = measure_pictures(dark, dark, ["cvvdp"], VIEWING)["cvvdp"].eyes["both"]
    assert found.remarks[0].startswith("X, Y or Z is below 0.005 or above 10000 cd/m² in 10 %")
    assert measure_pictures(picture(), picture(), ["cvvdp"], VIEWING)["cvvdp"].eyes["both"].remarks == ()
