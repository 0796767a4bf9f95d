from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from documents import InputError
from runner.cli.main import group
from stimuli.develop import read_camera_image
from tests.stimuli.bracket.sensor import TIMES, bracket, scene


def run(folder: Path, *words: str, output: str = "merged.exr") -> Result:
    photographs = bracket(folder, scene(48, 64, stops=5) / 4, TIMES[1:4])
    words = ("camera", "bracket", *map(str, photographs), "-o", str(folder / output), *words)
    return CliRunner().invoke(group, words)


def test_a_bracket_is_merged(tmp_path: Path) -> None:
    result = run(tmp_path, "--demosaic", "superpixel")
    assert result.exit_code == 0, result.output
    lines = result.stdout.splitlines()
    assert lines[0].strip() == "Exposures beside the shortest"
    assert lines[2].split() == ["1_125.dng", "1/125", "s", "1", "1"]
    assert lines[3].split()[:4] == ["1_60.dng", "1/60", "s", "2.083"]
    assert lines[-1] == "Written: merged.exr, 32×24"
    assert any(line.startswith("Noise in green: ") for line in lines)


def test_json_holds_every_step(tmp_path: Path) -> None:
    facts = json.loads(run(tmp_path, "--json", "--noise", "30000,6").stdout)
    assert facts["holds"] == "camera RGB"
    (step,) = [step for step in facts["steps"] if step["step"] == "merge"]
    assert step["noise"]["red"]["full_scale_electrons"] == pytest.approx(30000)
    assert read_camera_image(tmp_path / "merged.exr").rgb.shape == (48, 64, 3)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--noise", "3"], "the noise is '3'"),
        (["--exposure", "1/8,8,200"], "1 exposures are given for 3 photographs"),
        (["--dark", "no/such/frame.dng"], "there is no such file"),
    ],
)
def test_wrong_options_are_refused(tmp_path: Path, words: list[str], message: str) -> None:
    result = run(tmp_path, *words)
    said = str(result.exception) if isinstance(result.exception, InputError) else result.output
    assert result.exit_code != 0
    assert message in said
    assert not (tmp_path / "merged.exr").exists()


def test_the_output_is_an_exr_file(tmp_path: Path) -> None:
    result = run(tmp_path, output="merged.png")
    assert isinstance(result.exception, InputError)
    assert "no .exr file" in str(result.exception)
