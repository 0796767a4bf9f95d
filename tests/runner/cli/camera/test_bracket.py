from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from documents import InputError
from runner.cli.camera import camera_command as group
from stimuli.develop import read_camera_image
from tests.stimuli.bracket.sensor import TIMES, bracket, scene


def photographs(folder: Path) -> list[str]:
    return [str(path) for path in bracket(folder, scene(48, 64, stops=5) / 4, TIMES[1:4])]


def test_a_bracket_is_merged(tmp_path: Path) -> None:
    words = ["bracket", *photographs(tmp_path), "-o", str(tmp_path / "merged.exr"), "--demosaic", "superpixel"]
    result = CliRunner().invoke(group, words, catch_exceptions=False)
    assert result.exit_code == 0, result.output
    lines = result.stdout.splitlines()
    assert lines[0].strip() == "Exposures beside the shortest"
    assert lines[2].split() == ["1_125.dng", "1/125", "s", "1", "1"]
    assert lines[3].split()[:4] == ["1_60.dng", "1/60", "s", "2.083"]
    assert lines[-1] == "Written: merged.exr, 32×24"
    assert any(line.startswith("Noise in green: ") for line in lines)


def test_json_holds_every_step(tmp_path: Path) -> None:
    noise = ["--noise", "30000,6"]
    words = ["bracket", *photographs(tmp_path), "-o", str(tmp_path / "merged.exr"), "--json", *noise]
    facts = json.loads(CliRunner().invoke(group, words, catch_exceptions=False).stdout)
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
    output = tmp_path / "merged.exr"
    result = CliRunner().invoke(group, ["bracket", *photographs(tmp_path), "-o", str(output), *words])
    said = str(result.exception) if isinstance(result.exception, InputError) else result.output
    assert result.exit_code != 0
    assert message in said
    assert not output.exists()


def test_the_output_is_an_exr_file(tmp_path: Path) -> None:
    result = CliRunner().invoke(group, ["bracket", *photographs(tmp_path), "-o", str(tmp_path / "merged.png")])
    assert isinstance(result.exception, InputError)
    assert "no .exr file" in str(result.exception)
