"""Files of another kind than is wanted: told as that, and as nothing else."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from devices.camera.camera_file import read_camera
from devices.display.display_file import read_display
from devices.display.rig_file import read_rig
from devices.display.verification_file import read_verification
from documents import InputError
from documents.yaml.kinds import TELLING
from runner.check.files import _CHECKS
from runner.protocol.experiment import read_experiment
from stimuli.comparison.regions_file import read_regions
from stimuli.recipes.recipe import read_recipe

CONFIGS = Path("configs")
FILES = {
    "a display file": CONFIGS / "displays/asus_vg248qe.yaml",
    "a rig file": CONFIGS / "rigs/asus_vg248qe_3dvision.yaml",
    "a camera file": CONFIGS / "cameras/nikon_d800.yaml",
    "a file of areas to compare": CONFIGS / "regions/plate.yaml",
    "a recipe": CONFIGS / "stimuli/manitoba_gray.yaml",
    "an experiment": Path("experiments/dynamic_range.yaml"),
}
READERS: dict[str, Callable[[Path], Any]] = {
    "a display file": read_display,
    "a rig file": read_rig,
    "a camera file": read_camera,
    "a file of areas to compare": read_regions,
    "a recipe": read_recipe,
    "an experiment": read_experiment,
    "a photodiode's record": read_verification,
}


@pytest.mark.parametrize("given", FILES)
@pytest.mark.parametrize("wanted", READERS)
def test_one_finding_says_what_it_is_and_what_is_wanted(given: str, wanted: str) -> None:
    if given == wanted:
        READERS[wanted](FILES[given])
        return
    with pytest.raises(InputError) as caught:
        READERS[wanted](FILES[given])
    (finding,) = caught.value.findings
    called = "a recipe or observers file" if given == "a recipe" else given
    assert finding.message == f"this is {called}, not {wanted}"
    assert finding.file == str(FILES[given])
    assert finding.line


def test_a_file_with_the_telling_key_of_its_kind_has_faults_of_its_own(tmp_path: Path) -> None:
    for text, read, fault in (
        ("schema_version: 1\nkind: pictures\nmode: x\nstimuli: []\n", read_recipe, "unknown key 'mode'"),
        ("schema_version: 1\ndisplay: d.yaml\nmode: x\nmodes: {}\n", read_rig, "unknown key 'modes'"),
    ):
        (tmp_path / "f.yaml").write_text(text)
        with pytest.raises(InputError) as caught:
            read(tmp_path / "f.yaml")
        assert fault in str(caught.value)
        assert "this is" not in str(caught.value)


def test_every_kind_that_a_key_tells_can_be_checked() -> None:
    assert set(TELLING.values()) == set(_CHECKS)
