"""`cyclopean new`: what it prints can be typed, what is wrong ends with exit status 2."""

from __future__ import annotations

import json
import shlex
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from runner.cli.main import group, main
from runner.protocol import read_experiment
from tests.runner.studies.drawn_pictures import draw_flat

PANEL = ("--panel", "640x480,0.5")


def _new(*words: str | Path) -> Result:
    return CliRunner().invoke(group, ["new", *map(str, words)], catch_exceptions=False)


def test_the_commands_that_follow_can_be_typed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    draw_flat(tmp_path / "my photos", ("a", "b", "c"))
    done = _new("my study", "my photos", *PANEL)
    assert done.exit_code == 0
    assert "3 pictures, 3 trials" in done.stdout
    assert "nominal, not measured" in done.stdout
    commands = [shlex.split(line) for line in done.stdout.splitlines()[-3:]]
    assert [words[1] for words in commands] == ["check", "run", "report"]
    assert CliRunner().invoke(group, [*commands[0][1:], "--no-screen", "--no-pictures"]).exit_code == 0
    assert commands[1][2:] == ["my study/experiment.yaml", "--observer", "01"]
    assert commands[2][2:] == ["results/my_study"]


def test_json(tmp_path: Path) -> None:
    folder = draw_flat(tmp_path / "photos", ("a", "b"))
    facts = json.loads(_new(tmp_path / "s", folder, "--json", *PANEL).stdout)
    assert (facts["pictures"], facts["trials"], facts["mode"]) == (2, 1, "flat")
    assert Path(facts["experiment"]).is_file()
    assert facts["commands"][0][:2] == ["cyclopean", "check"]
    assert "dynamic_range" in json.loads(_new("--list", "--json").stdout)


def test_the_options_reach_the_study(tmp_path: Path) -> None:
    folder = draw_flat(tmp_path / "photos", ("a", "b"))
    words = ("--mode", "top-bottom", "--question", "Why?", "--white", "80", "--distance", "500", "--monitor", "2")
    assert _new(tmp_path / "s", folder, *words, *PANEL).exit_code == 0
    experiment = read_experiment(tmp_path / "s" / "experiment.yaml")
    rig = experiment.rig
    assert rig.nominal is not None
    assert (rig.mode, rig.spec.distance_mm, rig.monitors, rig.nominal.white_cd_m2) == ("top-bottom", 500, ("2",), 80)
    assert experiment.spec.question == "Why?"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], "cyclopean new my_study photos/"),
        (["my_study"], "cyclopean new my_study photos/"),
        (["my_study", "photos", "--panel", "wide"], "'wide' is no panel"),
        (["my_study", "nowhere"], "no such picture"),
        (["my_study", "photos", "--kind", "series"], "'series' is not one of"),
        (["my_study", "photos", "--from", "paints"], "its own pictures"),
        (["my_study", "--from", "paints", "--mode", "flat"], "leave out --mode"),
        (["my_study", "a.exr"], "ordinary pictures"),
        (["--from", "dynamic_rang"], "dynamic_range"),
    ],
)
def test_wrong_words_end_with_a_line_and_status_2(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], words: list[str], said: str
) -> None:
    monkeypatch.chdir(draw_flat(tmp_path / "photos", ("a", "b")).parent)
    monkeypatch.setattr(sys, "argv", ["cyclopean", "new", *words])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    assert said in capsys.readouterr().err
    assert [file.name for file in tmp_path.iterdir()] == ["photos"]
