"""Pairs within scenes, whole: from an experiment file to scores, in many designs, and pages of very many groups."""

from __future__ import annotations

import json
import math
import random
import re
import shutil
import subprocess
import time
from collections import Counter
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2

import cyclopean
from analysis.records import read_results
from analysis.report import describe, write_report
from runner.blocks import Stimuli
from runner.blocks.all_pairs import AllPairs
from runner.blocks.orders import grouped_order
from runner.blocks.pair_groups import pair_groups

pytestmark = pytest.mark.stress
ROOT = Path(__file__).parents[2]
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")


def study(folder: Path, scores: dict[str, dict[str, float]], blocks: list[Any], observers: int) -> Path:
    """Simulate an experiment whose stimuli have the scores given by scene and codec; return the folder of sessions."""
    folder.mkdir()
    cyclopean.write_picture(folder / "grey.exr", np.full((20, 40, 3), 5.0, np.float32))
    stimuli = [
        {"name": f"{scene}-{codec}", "file": "grey.exr", "factors": {"scene": scene, "codec": codec}}
        for scene, own in scores.items()
        for codec in own
    ]
    files = {
        "recipe": {"schema_version": 1, "kind": "pictures", "views": ["flat"], "stimuli": stimuli},
        "study": {
            "schema_version": 1,
            "name": "study",
            "rig": str(ROOT / "configs/rigs/asus_vg248qe_3dvision.yaml"),
            "stimuli": "recipe.yaml",
            "question": "Which is better?",
            "layout": {"arrangement": "vertical", "size_mm": [8, 4]},
            "blocks": blocks,
        },
        "observers": {
            "schema_version": 1,
            "kind": "bradley_terry",
            "stimuli": {
                f"{scene}-{codec}-flat": {"score": score}
                for scene, own in scores.items()
                for codec, score in own.items()
            },
        },
    }
    for name, data in files.items():
        (folder / f"{name}.yaml").write_text(json.dumps(data), encoding="utf-8")
    return cyclopean.simulate(folder / "study.yaml", folder / "observers.yaml", folder / "results", observers=observers)


def made_up(scenes: int, codecs: int, seed: int, sd: float = 0.5) -> dict[str, dict[str, float]]:
    """Return scores: a quality of each codec, and how it differs in each scene."""
    rng = random.Random(seed)
    return {
        f"s{s}": {f"c{c}": math.exp(0.5 * c + rng.gauss(0, sd)) for c in range(codecs)} for s in range(1, scenes + 1)
    }


@pytest.mark.parametrize(("scenes", "codecs", "observers"), [(2, 5, 20), (6, 4, 15), (12, 3, 15)])
def test_the_scores_of_every_scene_come_back(tmp_path: Path, scenes: int, codecs: int, observers: int) -> None:
    """Differences from the first codec, in the model's standard errors: their squares sum to a χ²."""
    scores = made_up(scenes, codecs, seed=scenes)
    results = study(tmp_path / "study", scores, [{"kind": "all_pairs", "within": "scene"}], observers)
    groups = describe(read_results(results), covariance="model").groups
    assert groups is not None
    assert [name for name, _ in groups.groups] == list(scores)
    statistic = 0.0
    for name, part in groups.groups:
        fit = part.estimate.plain
        true = np.log([scores[name][item.split("-")[1]] for item in part.scores.comparisons.items])
        error = (fit.theta - true)[1:] - (fit.theta - true)[0]
        contrast = np.eye(codecs)[1:] - np.eye(codecs)[0]
        statistic += float(error @ np.linalg.solve(contrast @ fit.covariance @ contrast.T, error))
    assert 1e-4 < chi2.cdf(statistic, scenes * (codecs - 1)) < 1 - 1e-4
    assert groups.scored.agreement is not None
    assert groups.scored.agreement.p is not None
    assert groups.scored.agreement.p < 0.01  # the codecs differ by 0.5 nats from scene to scene


def test_pairs_between_scenes_bring_one_scale(tmp_path: Path) -> None:
    scores = {
        name: {codec: 3.0 * score for codec, score in own.items()} if name == "s1" else own
        for name, own in made_up(4, 4, seed=3, sd=0.0).items()
    }
    block = {"kind": "all_pairs", "within": "scene", "across": "codec"}
    report = describe(read_results(study(tmp_path / "study", scores, [block], 20)))
    assert report.groups is None
    assert report.pairs is not None
    theta = dict(zip(report.pairs.scores.comparisons.items, report.pairs.scores.fit.theta.tolist(), strict=True))
    apart = np.mean([theta[f"s1-c{c}-flat"] - theta[f"s{s}-c{c}-flat"] for c in range(4) for s in (2, 3, 4)])
    assert apart == pytest.approx(math.log(3.0), abs=0.4)  # its standard error is about 0.1


def test_two_blocks_of_different_stimuli_have_a_scale_each(tmp_path: Path) -> None:
    """As experiments were written before `within`: their results get scores too."""
    scores = made_up(2, 4, seed=5)
    blocks = [{"kind": "all_pairs", "stimuli": [f"{s}-{c}-flat" for c in own]} for s, own in scores.items()]
    groups = describe(read_results(study(tmp_path / "study", scores, blocks, 20))).groups
    assert groups is not None
    assert groups.session_groups.factor == "scene"
    assert [name for name, _ in groups.groups] == ["s1", "s2"]
    assert groups.pooled is not None
    assert {item.name for item in groups.pooled.scores.items} == {"c0", "c1", "c2", "c3"}


def test_active_pairs_within_scenes_find_each_scale(tmp_path: Path) -> None:
    scores = made_up(2, 6, seed=7)
    block = {"kind": "active_pairs", "within": "scene", "trials_per_stimulus": 12}
    groups = describe(read_results(study(tmp_path / "study", scores, [block], 10))).groups
    assert groups is not None
    for name, part in groups.groups:
        assert part.estimate.method == "learnt_prior"
        true = [math.log(scores[name][item.name.split("-")[1]]) for item in part.scores.items]
        assert np.corrcoef(np.array(true), part.scores.fit.theta[list(part.scores.order)])[0, 1] > 0.9


def test_any_design_has_as_many_trials_as_check_says() -> None:
    """Drawn designs of uneven scenes, with and without pairs between them: faults, or an order that is right."""
    right = 0
    for seed in range(400):
        rng = random.Random(seed)
        factors: dict[str, dict[str, str | float]] = {
            f"x{number}": {"scene": f"s{rng.randrange(rng.choice((1, 3, 6)))}", "codec": float(rng.randrange(4))}
            for number in range(rng.randrange(2, 24))
        }
        stimuli = Stimuli(factors)
        across = rng.choice((None, "codec"))
        spec = AllPairs(kind="all_pairs", within="scene", across=across)
        if list(spec.faults(stimuli)):
            continue
        right += 1
        sets = pair_groups(stimuli.names, stimuli, "scene", across).sets
        assert len(spec.pairs(stimuli)) == len(sets)
        order = grouped_order(sets, 2, f"side {seed}", f"order {seed}")
        assert Counter((min(pair), max(pair)) for pair in order) == dict.fromkeys(sets, 2)
        first, times = Counter(pair[0] for pair in order), Counter(item for pair in order for item in pair)
        assert all(2 * first[item] == times[item] for item in times)
        most = max(Counter(sets.values()).values())
        if across is None and 2 * most <= len(sets):
            shown = [sets[min(pair), max(pair)] for pair in order]
            assert not any(one == other for one, other in pairwise(shown))
    assert right > 100


def test_a_page_of_thirty_scenes_is_soon_written_and_fits_a_phone(tmp_path: Path) -> None:
    scores = made_up(30, 4, seed=11)
    results = study(tmp_path / "study", scores, [{"kind": "all_pairs", "within": "scene"}], 5)
    began_s = time.process_time()
    write_report(read_results(results), tmp_path / "report.html", csv_folder=tmp_path / "csv")
    assert time.process_time() - began_s < 120
    assert len(list((tmp_path / "csv").glob("scores_*.csv"))) == 30
    if CHROMIUM is None:
        pytest.skip("no Chromium is installed: the page is not opened in a browser")
    frame = tmp_path / "frame.html"
    frame.write_text(
        '<body><iframe src="report.html" style="width:390px;height:800px;border:0"></iframe><p></p><script>'
        "onload = () => { const root = frames[0].document.documentElement;"
        "document.querySelector('p').textContent = 'wide ' + root.scrollWidth + ' of ' + root.clientWidth; }</script>"
    )
    quiet = ["--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path / 'profile'}", "--dump-dom"]
    command = [CHROMIUM, *quiet, "--allow-file-access-from-files", "--virtual-time-budget=5000", frame.as_uri()]
    shown = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True).stdout
    wide = re.search(r"wide (\d+) of (\d+)", shown)
    assert wide is not None
    assert int(wide.group(1)) <= int(wide.group(2))
