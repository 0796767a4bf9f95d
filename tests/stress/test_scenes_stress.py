"""Pairs within scenes, shared pairs, choices from series and the reports on them, whole, in many designs."""

from __future__ import annotations

import json
import math
import random
import re
import shutil
import subprocess
from collections import Counter
from collections.abc import Callable, Sequence
from itertools import combinations, pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import chi2

import cyclopean
from analysis.records import SessionLog, new_header, read_results
from analysis.report import Report, describe, write_report
from analysis.scaling import compared_groups
from analysis.series import means
from analysis.series.just_noticeable import Matches, fit, interval
from analysis.series.observer_means import bounded_means
from runner.blocks import Pair, Stimuli, pairs_in_groups
from runner.blocks.all_pairs import AllPairs
from runner.blocks.incomplete_pairs import PLACES, designs, fewest_pairs
from runner.blocks.orders import grouped_order
from runner.reports.results import print_pdf
from tests.answers import new_answer
from tests.kept import known
from tests.stress.how_many import how_many

pytestmark = pytest.mark.stress


# Pairs within scenes, shared pairs and choices from series, whole, in many designs.

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
    groups = known(describe(read_results(results), covariance="model").groups)
    assert [name for name, _ in groups.groups] == list(scores)
    statistic = 0.0
    for name, part in groups.groups:
        fit = part.estimate.plain
        true = np.log([scores[name][item.split("-")[1]] for item in part.scores.comparisons.items])
        error = (fit.theta - true)[1:] - (fit.theta - true)[0]
        contrast = np.eye(codecs)[1:] - np.eye(codecs)[0]
        statistic += float(error @ np.linalg.solve(contrast @ fit.covariance @ contrast.T, error))
    assert 1e-4 < chi2.cdf(statistic, scenes * (codecs - 1)) < 1 - 1e-4
    assert known(known(groups.scored.agreement).p) < 0.01  # the codecs differ by 0.5 nats from scene to scene


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
    groups = known(describe(read_results(study(tmp_path / "study", scores, blocks, 20))).groups)
    assert groups.session_groups.factor == "scene"
    assert [name for name, _ in groups.groups] == ["s1", "s2"]
    assert {item.name for item in known(groups.pooled).scores.items} == {"c0", "c1", "c2", "c3"}


def test_active_pairs_within_scenes_find_each_scale(tmp_path: Path) -> None:
    scores = made_up(2, 6, seed=7)
    block = {"kind": "active_pairs", "within": "scene", "trials_per_stimulus": 12}
    groups = known(describe(read_results(study(tmp_path / "study", scores, [block], 10))).groups)
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
        sets = pairs_in_groups(stimuli.names, stimuli, "scene", across).sets
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


# Shared pairs pushed to the edges: drawn sets of pairs, all places, from the fewest pairs that link to all.
def sets(count: int, pairs: list[Pair]) -> list[tuple[int, ...]]:
    """Return what pairs link."""
    compared: NDArray[np.float64] = np.zeros((count, count))
    for pair in pairs:
        compared[pair] = 1.0
    return sorted(tuple(part) for part in compared_groups(compared))


def test_any_pairs_are_shared_evenly_and_each_part_links_what_all_link() -> None:
    for seed in range(60):
        rng = random.Random(seed)
        count = rng.randrange(2, 16)
        every = list(combinations(range(count), 2))
        pairs = sorted(rng.sample(every, rng.randint(1, len(every))))
        whole = sets(count, pairs)
        fewest = fewest_pairs(count, pairs)
        assert fewest == count - len(whole)
        each = rng.choice((fewest, rng.randint(fewest, len(pairs)), len(pairs)))
        times = np.zeros(len(pairs), dtype=np.int64)
        parts = list(designs(count, pairs, each, f"seed {seed}", PLACES))
        for part in parts:
            assert len(set(part)) == len(part) == each
            assert sets(count, [pairs[index] for index in part]) == whole
            times[part] += 1
        assert times.sum() == PLACES * each


# Choices from series pushed to the edges: what intervals are worth, many observers, large and small numbers.

LEVELS = np.log([1.3, 1.6, 2.0, 2.5, 3.0, 4.0])
CUTS = np.concatenate([[-np.inf], (LEVELS[1:] + LEVELS[:-1]) / 2, [np.inf]])
LENGTH = float(LEVELS[-1] - LEVELS[0])


@pytest.mark.parametrize(("within", "between"), [(0.12, 0.0), (0.25, 0.15), (0.3, 0.4)])
def test_the_step_s_interval_holds_the_truth(within: float, between: float) -> None:
    """Studies of fifteen observers and five paints: 95 % hold it, 89 % less two standard errors at the least."""
    random = np.random.default_rng(15)
    held = told = 0
    estimates = []
    observer = np.repeat(np.arange(15), 5)
    studies = how_many(40, 80)
    for _ in range(studies):
        match = np.log(2.2) + between * random.standard_normal(15)[observer] + within * random.standard_normal(75)
        index = np.searchsorted(CUTS, match) - 1
        matches = Matches.of(CUTS[index], CUTS[index + 1], observer)
        found = fit(matches, float(LEVELS[index].mean()), LENGTH)
        if isinstance(found, str):
            continue
        limits = known(interval(matches, found, LENGTH))
        told += 1
        estimates.append(found[1])
        held += limits[0] <= within and (limits[1] is None or within <= limits[1])
    print(f"within {within}, between {between}: {held} of {told} held, median {np.median(estimates):.3f}")
    assert told >= 0.97 * studies
    assert held >= 0.88 * told
    assert np.median(estimates) == pytest.approx(within, rel=0.08)


@pytest.mark.parametrize("observers", [15, 30])
def test_means_hold_the_truth(observers: int) -> None:
    """Skewed, rounded ratings of five paints by observers of their own leaning, in 1000 studies."""
    random = np.random.default_rng(30)
    truth = 6.0
    held = 0
    for _ in range(1000):
        lean = truth - 1.5 + random.gamma(2.0, 0.75, observers)
        ratings = lean[:, None] + random.normal(0, 1, (observers, 5))
        (found,) = means(ratings.sum(axis=1)[:, None], np.full((observers, 1), 5.0), replicates=1000)
        held += found.low is not None and found.high is not None and found.low <= truth <= found.high
    print(f"{observers} observers: {held} of 1000 held")
    assert held >= (925 if observers == 30 else 915)


@pytest.mark.parametrize("series", [1, 5])
@pytest.mark.parametrize("observers", [5, 10, 15, 30])
@pytest.mark.parametrize("share", [0.05, 0.1, 0.3, 0.6, 0.9])
@pytest.mark.parametrize("alike", [True, False])
def test_scores_of_rare_and_common_pictures_contain_the_truth(
    observers: int, series: int, share: float, alike: bool
) -> None:
    """2000 studies: 92 % and more; less only for a picture that most studies of so few answers never see chosen.

    Observers who are not alike choose it with shares of their own, and all rate on a level of their own.
    """
    random = np.random.default_rng([observers, series, round(100 * share), alike])
    size = series, observers, 2000
    own = np.full(size[1:], share) if alike else random.beta(3 * share, 3 * (1 - share), size[1:])
    rated = np.clip(np.round(6.5 + random.normal(0, 1, size[1:]) + random.normal(0, 1.2, size)), 1, 10)
    given = (random.random(size) < own) * rated
    truth = share * float(np.clip(np.round(6.5 + random.normal(0, np.hypot(1, 1.2), 4_000_000)), 1, 10).mean())
    found = bounded_means(given.sum(axis=0), (given**2).sum(axis=0), np.full(size[1:], float(series)), 10.0)
    held = [one.low <= truth <= one.high for one in found if one.low is not None and one.high is not None]
    coverage, seen = float(np.mean(held)), len(held) / len(found)
    print(f"{observers} observers of {series}, {share:.0%}, alike {alike}: {coverage:.1%}, seen in {seen:.0%}")
    assert coverage >= (0.915 if seen > 0.5 else 0.87)
    assert coverage <= 0.995


# Reports with hostile names, 200 stimuli and 60 observers: text stays text, and everything stays inside its page.

QUIET = ["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking"]
LONG = "W" * 300
HOSTILE = (
    "<script>document.title='owned'</script>",
    LONG,
    "משטח-א-" * 12,
    "塗装の見本" * 20,
    '"><img src=x onerror=alert(1)>',
    "a b\u202ec d\u200f",
    "$\\frac{1}{2}$ & {{ 7*7 }}",
    "=HYPERLINK(1)",
    "🎨" * 40,
    "i\u0307" * 60,
)
UTC = "2026-01-02T03:04:05Z"
# How far the page is wider than its window, and how much of the drawings' text lies outside its drawing.
MEASURE = """
<script>onload = () => {
  const page = frames[0].document, root = page.documentElement;
  const outside = [...page.querySelectorAll("svg")].filter(one => one.getBoundingClientRect().width)
    .flatMap(one => [...one.querySelectorAll("text")].filter(text => {
      const own = text.getBoundingClientRect(), all = one.getBoundingClientRect();
      return own.left < all.left - 4 || own.right > all.right + 4;
    }));
  document.querySelector("p").textContent =
    `${root.scrollWidth} of ${root.clientWidth}, ${outside.length} outside: ` +
    outside.slice(0, 3).map(text => text.textContent);
}</script>
"""


def session(observer: str, names: Sequence[str], kind: str, answers: Sequence[dict[str, Any]]) -> SessionLog:
    stimuli = tuple({"name": name, "factors": {"paint": name[:3], "level": place}} for place, name in enumerate(names))
    header = new_header(
        HOSTILE[0],
        observer,
        f"s{observer}",
        UTC,
        seed=1,
        question=HOSTILE[1],
        stimuli=stimuli,
        display={"mode": "flat"},
    )
    trials = tuple(new_answer(0, number, kind, (), 1.0, UTC, answer) for number, answer in enumerate(answers))
    return SessionLog(Path(f"{observer}.jsonl"), header, trials, complete=True)


def compared(stimuli: int, observers: int, each: int) -> list[SessionLog]:
    """Return sessions in which each observer compares neighbours in quality, and pairs at random."""
    names = [*HOSTILE, *(f"stimulus {number}" for number in range(stimuli - len(HOSTILE)))][:stimuli]
    sessions = []
    for person in range(observers):
        rng = random.Random(person)
        pairs = [(place, (place + 1) % stimuli) for place in range(stimuli)]
        pairs += [tuple(rng.sample(range(stimuli), 2)) for _ in range(each)]  # type: ignore[misc]  # two of them
        answers = []
        for one, other in pairs:
            chosen, rejected = (one, other) if rng.random() < 1 / (1 + 2 ** ((one - other) / 10)) else (other, one)
            answers.append(
                {"first": names[one], "second": names[other], "chosen": names[chosen], "rejected": names[rejected]}
            )
        sessions.append(session(HOSTILE[person % 5] if person < 5 else f"{person:02d}", names, "all_pairs", answers))
    return sessions


def rated(stimuli: int, observers: int) -> list[SessionLog]:
    names = [*HOSTILE, *(f"stimulus {number}" for number in range(stimuli - len(HOSTILE)))][:stimuli]
    sessions = []
    for person in range(observers):
        rng = random.Random(person)
        answers = [
            {
                "stimulus": name,
                "ratings": {HOSTILE[0]: rng.randint(1, 9), LONG: rng.randint(1, 9)},
                "rating_times_s": {},
            }
            for name in names
        ]
        sessions.append(session(f"{person:02d}", names, "rating", answers))
    return sessions


@pytest.fixture
def look(tmp_path: Path) -> Callable[[Path, int], str]:
    def measured(page: Path, width_px: int) -> str:
        if CHROMIUM is None:
            pytest.skip("no Chromium is installed: the page is not opened in a browser")
        frame = f'<iframe src="{page.name}" style="width:{width_px}px;height:900px;border:0"></iframe><p></p>{MEASURE}'
        outer = page.with_name("outer.html")
        outer.write_text(f"<!doctype html><body>{frame}", encoding="utf-8")
        options = ["--allow-file-access-from-files", "--virtual-time-budget=20000", "--window-size=1500,1000"]
        command = [CHROMIUM, *QUIET, *options, f"--user-data-dir={tmp_path / 'profile'}", "--dump-dom", outer.as_uri()]
        shown = subprocess.run(command, capture_output=True, text=True, timeout=300, check=True).stdout
        found = re.search(r"<p>(.*)</p>", shown, re.DOTALL)
        assert found is not None, shown[-500:]
        return found.group(1)

    return measured


MAKERS = {
    "200 stimuli, 60 observers": lambda: compared(200, 60, 200),
    "10 hostile stimuli": lambda: compared(10, 12, 30),
    "one observer": lambda: compared(10, 1, 10),
    "200 ratings of 60 observers on two scales": lambda: rated(200, 60),
}


@pytest.mark.parametrize("make", MAKERS.values(), ids=MAKERS)
def test_everything_stays_inside(
    make: Callable[[], list[SessionLog]], look: Callable[[Path, int], str], tmp_path: Path
) -> None:
    page = tmp_path / "report.html"
    report: Report = write_report(make(), page, csv_folder=tmp_path / "csv", figure_folder=tmp_path / "figures")
    text = page.read_text(encoding="utf-8")
    assert "<script" not in text
    assert "<img" not in text
    assert report.notes is not None
    for width_px in (390, 1200):
        told = look(page, width_px)
        wide = re.match(r"(\d+) of (\d+), (\d+) outside", told)
        assert wide is not None, told
        assert int(wide[1]) <= int(wide[2]), told
        assert int(wide[3]) == 0, told
    print_pdf(page, tmp_path / "report.pdf")
    assert (tmp_path / "report.pdf").read_bytes().startswith(b"%PDF-")
    svgs, pdfs = (sorted(file.stem for file in (tmp_path / "figures").glob(f"*.{kind}")) for kind in ("svg", "pdf"))
    assert svgs == pdfs
    assert svgs
