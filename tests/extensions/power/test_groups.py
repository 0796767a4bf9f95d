"""`cyclopean power` on an experiment with pairs within scenes: a scale for each scene, one number of observers."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result

from documents import InputError
from extensions.power import PowerOptions, study_power
from runner.cli.main import group
from tests.runner.reports.test_designs import SCENES

Study = Any  # tests/conftest.py
WORDS = ("--observers", "10,30", "--replicates", "120", "--observer-sd", "0.5")


def ask(study: Study, *words: str) -> Result:
    """Call the command with the scores."""
    names = ["power", str(study.experiment), "--scores", str(study.observers), *WORDS, *words]
    return CliRunner(catch_exceptions=True).invoke(group, names)


def test_each_scene_is_the_power_of_its_own_pairs(scenes: Study, tmp_path: Path) -> None:
    result = ask(scenes, "--json")
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    assert [one["name"] for one in found["groups"]] == list(SCENES)
    for one, names in zip(found["groups"], SCENES.values(), strict=True):
        assert tuple(item["name"] for item in one["items"]) == names
        assert one["covariance"] == "shrinkage"
    # The first group is simulated like an experiment of this group alone.
    text = scenes.experiment.read_text().replace("within: scene", "stimuli: [l1, l2, l3]")
    scenes.experiment.write_text(text)
    alone = json.loads(ask(scenes, "--json").stdout)
    assert found["groups"][0]["sizes"] == alone["sizes"]
    # g2 and g3 are almost equal: the answer is the hardest group's.
    assert found["groups"][0]["needed"]["observers"] is not None
    assert found["needed"]["observers"] is None
    assert "6 of 9 reach it" in found["needed"]["sentence"]
    assert "g2 and g3 in garden" in found["needed"]["sentence"]
    assert {pair["group"] for pair in found["needed"]["pairs"]} == set(SCENES)


def test_named_pairs_decide_in_their_groups(scenes: Study) -> None:
    easy = json.loads(ask(scenes, "--json", "--pair", "l1", "l3", "--pair", "g1", "g4").stdout)
    assert easy["needed"]["observers"] == 10
    assert "the 2 pairs named in 2 groups" in easy["needed"]["sentence"]
    one = json.loads(ask(scenes, "--json", "--pair", "g1", "g4").stdout)
    assert [each["name"] for each in one["groups"]] == ["garden"]
    assert one["notes"] == [one["notes"][0]]
    assert "lobby" in one["notes"][0]
    options = PowerOptions((10,), scores=scenes.observers, pairs=(("l1", "g1"),), replicates=2)
    with pytest.raises(InputError, match="l1 and g1 are in different groups"):
        study_power(scenes.experiment, options)


@pytest.mark.usefixtures("undrawn")
def test_text_table_and_page_show_each_scene(scenes: Study, tmp_path: Path) -> None:
    page, table = tmp_path / "power.html", tmp_path / "power.csv"
    result = ask(scenes, "-o", str(page), "--csv", str(table))
    assert result.exit_code == 0, result.output
    lines = result.stdout.splitlines()
    assert [name for name in SCENES if name in [line.strip() for line in lines]] == list(SCENES)
    rows = table.read_text(encoding="utf-8").splitlines()
    assert rows[0] == "group,observers,quantity,item,other,value,standard_error"
    assert len(rows) == 1 + 2 * (2 + 3 + 3) + 2 * (2 + 4 + 6)
    html = page.read_text(encoding="utf-8")
    assert html.count("<svg") == 6
    for name in SCENES:
        assert f'<span class="subject">{name}</span></h2>' in html
        assert f'<a href="#curves-{name}">Curves {name}</a>' in html


def test_without_scores_each_scene_has_its_own_steps(scenes: Study) -> None:
    study = study_power(scenes.experiment, PowerOptions((10,), replicates=20, workers=1))
    for own in study.to_json()["groups"]:
        thetas = [item["theta"] for item in own["items"]]
        assert max(thetas) - min(thetas) == pytest.approx(2.0)
    assert "within each group" in study.notes[0]
    assert [sd for sd, _ in study.by_observer_sd] == [0.0, 0.7, 1.5]
