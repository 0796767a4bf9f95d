"""The experiments that come with the program, by simulated observers: in small with the tests, whole in `stress`."""

from __future__ import annotations

import shutil
from collections import Counter
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
import yaml

from analysis.records import SessionLog, read_session
from runner.observers import read_observer
from runner.protocol import read_experiment
from runner.session import SessionOptions
from runner.session.station import Station
from stimuli.build import build_set
from tests.invoked import printed_json

pytestmark = pytest.mark.nightly
ROOT = Path(__file__).parents[2]
SMALL_MM = [12, 8]
SMALL_PIXELS = 43 * 29  # at the panel's 0.2768 mm per pixel
EXPOSURES_S = (1.3, 1.6, 2, 2.5, 3, 4)


def copied(folder: Path, name: str, *, small: bool) -> Path:
    """Copy an experiment with all it names, its pictures made small if asked, and return its file."""
    shutil.copytree(ROOT / "configs", folder / "configs")
    file = folder / "experiments" / f"{name}.yaml"
    file.parent.mkdir()
    shutil.copy(ROOT / "experiments" / file.name, file)
    if small:
        experiment: Any = yaml.safe_load(file.read_text())
        recipe_file = file.parent / experiment["stimuli"]
        experiment["layout"]["size_mm"] = SMALL_MM
        file.write_text(yaml.safe_dump(experiment, sort_keys=False))
        recipe: Any = yaml.safe_load(recipe_file.read_text())
        recipe["plate"]["size_mm"] = SMALL_MM
        recipe_file.write_text(yaml.safe_dump(recipe, sort_keys=False))
    return file


def simulated(file: Path, law: str, observer: str) -> SessionLog:
    """Run one simulated observer's whole session through the command line and read its log."""
    results = file.parent.parent / "results"
    laws = file.parent.parent / "configs" / "observers" / f"{law}.yaml"
    words = ["run", file, "--observer", observer, "--simulate", laws, "--results", results]
    done = printed_json(*words)
    assert done["ending"] == "completed"
    assert done["answered"] == done["trials"]
    log = read_session(Path(done["folder"]) / "session.jsonl")
    assert log.complete
    return log


def check_series(log: SessionLog) -> list[dict[str, Any]]:
    """Check one session of the first experiment and return what its choices recorded."""
    assert len(log.header.stimuli) == 90
    assert Counter(trial.kind for trial in log.trials) == {"instructions": 1, "best_of_series": 15}
    choices = [dict(trial.details()) for trial in log.trials if trial.kind == "best_of_series"]
    paints = [choice["series"].split("-")[0] for choice in choices]
    assert len({choice["series"] for choice in choices}) == 15
    assert Counter(paints) == dict.fromkeys(("GM1", "GM2", "HI", "BC", "BR"), 3)
    assert all(one != other for one, other in pairwise(paints))
    for choice in choices:
        assert choice["stimuli"] == [f"{choice['series']}-{exposure_s:g}" for exposure_s in EXPOSURES_S]
        assert choice["chosen"] == choice["stimuli"][choice["chosen_index"]]
        assert {index for index, _ in choice["path"]} == set(range(6))
        assert choice["path"][0][0] == choice["start"]
        assert choice["path"][-1][0] == choice["chosen_index"]
        assert all(seconds > 0 for seconds in choice["dwell_s"])
        assert set(choice["ratings"]) == {"similarity", "difficulty"}
        assert all(1 <= number <= 10 for number in choice["ratings"].values())
        assert set(choice["clipping"]) == set(choice["stimuli"])
    return choices


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep what is built here to itself."""
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / "cache"))


@pytest.mark.stress
def test_the_first_experiment_whole_with_the_thesis_s_fifteen_observers(tmp_path: Path) -> None:
    file = copied(tmp_path, "exposure_series", small=False)
    (facts,) = printed_json("check", file)
    assert (facts["findings"], facts["stimuli"], facts["trials"]) == ([], 90, 15)
    design = read_experiment(file)
    laws = tmp_path / "configs" / "observers" / "figure_4_14.yaml"
    law = read_observer(laws, design.stimulus_names, design.stimuli.reference)
    stimuli = build_set(design.recipe_file, design.rig.display.panel.pixel_pitch_mm)
    assert stimuli.rendered == 0  # the check has built them
    chosen: Counter[tuple[str, int]] = Counter()
    with Station.open(design, stimuli, SessionOptions(tmp_path / "results", backend="egl")) as station:
        for observer in (f"{number:02d}" for number in range(1, 16)):
            folder = station.run(observer, station.simulated(law, observer), simulated=True)
            for choice in check_series(read_session(folder / "session.jsonl")):
                chosen[choice["series"].split("-")[1], choice["chosen_index"]] += 1
    # By the scores, the highest exposure is chosen in 27 % of 75 base series and 45 % of 150 others: within 3.5 sd.
    assert 7 <= chosen["base", 5] <= 34
    assert 47 <= chosen["brighter", 5] + chosen["grey", 5] <= 90
    assert all(chosen[kind, 5] == max(chosen[kind, n] for n in range(6)) for kind in ("brighter", "grey"))
