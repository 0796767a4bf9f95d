"""The face for a notebook: the same numbers as the packages give, as tables."""

from __future__ import annotations

import inspect
import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import colour
import numpy as np
import pandas as pd
import pytest

import cyclopean
from analysis.comparisons import from_sessions
from analysis.observers import observers_in_sessions
from analysis.records import new_header, read_results
from analysis.report import describe
from analysis.scaling import GroupedScores, Scores
from documents import InputError, counted_work
from tests.answers import new_answer
from tests.choice import nightly
from tests.conftest import write_study
from tests.kept import known
from tests.pages import Page
from tests.runner.cli.every_command import commands

ROOT = Path(__file__).parents[2]
Study = Any  # tests/conftest.py


@pytest.fixture(name="command")
def _command(request: pytest.FixtureRequest) -> Callable[..., subprocess.CompletedProcess[str]]:
    """The command line; its fixture has the package's name."""
    run: Callable[..., subprocess.CompletedProcess[str]] = request.getfixturevalue("cyclopean")
    return run


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Sessions of three simulated observers who compared all pairs of four pictures; nothing is to be written there."""
    study = write_study(tmp_path_factory.mktemp("study"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CYCLOPEAN_CACHE", str(study.folder / "cache"))
        yield cyclopean.simulate(study.experiment, study.observers, study.results, observers=3)


def test_the_names_are_there_and_lazy() -> None:
    names = dir(cyclopean)
    assert 10 <= len(names) <= 24
    for name in names:
        assert getattr(cyclopean, name).__doc__, name
    code = "import sys, cyclopean; print([m for m in ('pandas', 'scipy', 'moderngl', 'colour') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("hides", ["analysis.py", *nightly("stimuli/__init__.py")])
def test_a_file_that_hides_a_package_is_named(hides: str, tmp_path: Path) -> None:
    (tmp_path / hides).parent.mkdir(exist_ok=True)
    (tmp_path / hides).write_text("")
    code = f"import sys; sys.path[:0] = [{str(tmp_path)!r}, {str(ROOT)!r}]; import cyclopean"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path)
    last = done.stderr.strip().splitlines()[-1]
    assert last.startswith("ImportError: ")
    assert str(tmp_path / Path(hides).parts[0]) in last


def test_results_are_a_row_for_each_trial(results: Path) -> None:
    trials = cyclopean.read_results(results)
    logs = read_results(results)
    assert len(trials) == sum(len(log.trials) for log in logs)
    assert sorted(trials["observer"].unique()) == ["01", "02", "03"]
    pairs = trials[trials["kind"] == "all_pairs"]
    assert (pairs["chosen"] != pairs["rejected"]).all()
    assert pairs["response_time_s"].dtype == np.float64
    first = next(trial for trial in logs[0].trials if trial.kind == "all_pairs")
    row = pairs.iloc[0]
    assert (row["chosen"], row["block"], row["trial"]) == (first.details()["chosen"], first.block, first.trial)
    clipped = first.details()["clipping"][first.details()["second"]]["right"]["percent_any"]
    assert row["clipping.second.right.percent_any"] == clipped
    assert not [name for name in trials if "clipping.one" in str(name)]


def test_scores_are_those_of_the_command_whatever_the_answers_come_as(
    results: Path, command: Callable[..., subprocess.CompletedProcess[str]], tmp_path: Path
) -> None:
    trials = cyclopean.read_results(results)
    pairs = trials[trials["kind"] == "all_pairs"]
    table = pd.DataFrame({"winner": pairs["chosen"], "loser": pairs["rejected"], "observer": pairs["observer"]})
    table.to_csv(tmp_path / "table.csv", index=False)
    printed = json.loads(command("scores", tmp_path / "table.csv", "--json", "--method", "firth").stdout)
    expected = {item["name"]: item["score"] for item in printed["items"]}
    for answers in (results, trials, table, tmp_path / "table.csv", str(tmp_path / "table.csv")):
        frame = cyclopean.scores(answers, method="firth").to_frame()
        assert dict(zip(frame["name"], frame["score"], strict=True)) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("scene", [False, True], ids=["one scale", "groups"])
def test_what_is_not_read_is_not_computed(*, scene: bool) -> None:
    """Classes of many items take longer than the fit, and the bootstrap over many observers yet longer."""
    random = np.random.default_rng(3)
    pairs = [random.permutation(list("abcd"))[:2] for _ in range(400)]
    answers = pd.DataFrame(pairs, columns=["winner", "loser"]).assign(observer=random.integers(0, 12, 400).astype(str))
    scales = 3 if scene else 1
    with counted_work() as work:
        result = cyclopean.scores(answers.assign(scene=["x", "y"] * 200) if scene else answers)
        assert str(scales - 1 if scene else 4) in repr(result)
        value: Any = result.value
        parts: list[Any] = [*(part for _, part in value.groups), value.pooled] if scene else [value]
        assert [len(part.fit.theta) for part in parts] == [4] * scales
        assert (work["classes_found"], work["tests_by_observers"]) == (0, 0)
        assert len(result.to_frame()) == 4 * scales
        assert all(result.to_frame()["class"])
        assert (work["classes_found"], work["tests_by_observers"]) == (scales, 0)
        told = result.value.to_json()
        first = told["groups"][0] if scene else told
        assert [row["theta"] for row in first["items"]] == [row["theta"] for row in result.rows[:4]]
        assert 0 < first["goodness_of_fit"]["by_observers"]["p"] <= 1
        assert (work["classes_found"], work["tests_by_observers"]) == (scales, scales)


def test_a_wrong_level_or_correction_is_refused_before_the_classes_are_read() -> None:
    answers = pd.DataFrame({"winner": list("aab"), "loser": list("bba")})
    for wrong in ({"alpha": 1.5}, {"adjust": "bonferroni"}):
        with pytest.raises(InputError):
            cyclopean.scores(answers, **wrong)


def test_separation_is_in_the_title() -> None:
    answers = pd.DataFrame({"winner": ["a", "a"], "loser": ["b", "b"]})
    result = cyclopean.scores(answers, method="ml")
    assert repr(result).startswith("<No finite estimate")
    assert result.to_frame()["score"].isna().all()
    firth = cyclopean.scores(answers, method="firth")
    assert firth.to_frame()["score"].sum() == pytest.approx(1)
    assert cyclopean.scores(answers).to_frame().equals(firth.to_frame())
    assert repr(cyclopean.scores(answers)) == repr(firth)


def test_options_reach_the_fit() -> None:
    answers = pd.DataFrame(
        {"winner": list("abacbc"), "loser": list("bacacb"), "count": [9, 4, 8, 3, 7, 5], "observer": list("112233")}
    )
    by_jod = cyclopean.scores(answers, model="thurstone", covariance="sandwich", adjust="bh", alpha=0.1)
    assert isinstance(by_jod.value, Scores)
    assert (by_jod.value.fit.model, by_jod.value.fit.covariance_kind) == ("thurstone", "sandwich")
    assert "jod" in by_jod.to_frame()


def test_comparisons_of_trials_are_those_of_the_sessions(results: Path) -> None:
    from cyclopean.scaling import comparisons

    direct = from_sessions(read_results(results))
    again = comparisons(cyclopean.read_results(results))
    order = [again.items.index(name) for name in direct.items]
    np.testing.assert_array_equal(again.wins[np.ix_(order, order)], direct.wins)
    assert again.first_share() == direct.first_share()


def test_observers_have_a_row_each(results: Path) -> None:
    frame = cyclopean.observers(results).to_frame()
    table = observers_in_sessions(read_results(results))
    assert list(frame["observer"]) == [line.name for line in table.lines]
    assert list(frame["answers"]) == [line.answers for line in table.lines]
    assert (frame["complete"] == 1).all()
    of_frame = cyclopean.observers(cyclopean.read_results(results)).to_frame()
    assert list(of_frame["answers"]) == list(frame["answers"])


def test_effects_of_factors(results: Path) -> None:
    with pytest.raises(InputError, match="does not name the factors"):
        cyclopean.effects(cyclopean.read_results(results))
    factors = {name: {"rank": rank} for rank, name in enumerate(("one", "two", "three", "four"))}
    frame = cyclopean.effects(results, factors).to_frame()
    assert list(zip(frame["factor"], frame["level"], strict=True)) == [("rank", "per unit")]
    trials = cyclopean.read_results(results)
    again = cyclopean.effects(trials, factors).to_frame()
    assert again["estimate"].item() == pytest.approx(frame["estimate"].item(), rel=1e-9)


def test_effects_without_a_finite_estimate_say_what_to_type() -> None:
    answers, factors = pd.DataFrame({"winner": ["a"], "loser": ["b"]}), {"a": {"view": "x"}, "b": {"view": "y"}}
    found = cyclopean.effects(answers, factors)
    assert "method='map'" in repr(found)
    assert len(found.to_frame()) == 0
    assert np.isfinite(cyclopean.effects(answers, factors, method="map").to_frame()["estimate"]).all()


def test_results_are_exported(results: Path, tmp_path: Path) -> None:
    folder = cyclopean.export_bids(results, folder=tmp_path / "bids", name="Four pictures")
    described = json.loads((folder / "dataset_description.json").read_text(encoding="utf-8"))
    assert described["Name"] == "Four pictures"


@pytest.mark.nightly
@pytest.mark.usefixtures("undrawn")
def test_the_demonstration_writes_its_report(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / "cache"))
    shown = cyclopean.demo(tmp_path / "demo", observers=2)
    assert shown.value.page.is_file()
    assert len(shown.to_frame()) == 10
    ours, thesis = shown.value.report.pairs, shown.value.thesis
    assert ours is not None
    assert thesis.classes is not None
    assert (ours.alpha, ours.adjust) == (0.05, "holm")
    assert ours.scores.fit.clustered is not None
    assert (thesis.classes.alpha, thesis.classes.adjust, thesis.fit.covariance_kind) == (0.045, "none", "model")
    again = known(describe(read_results(shown.value.page.parent)).pairs)
    assert again.beside is not None
    assert (again.alpha, again.adjust, again.scores.items) == (ours.alpha, ours.adjust, ours.scores.items)
    assert again.beside.items == thesis.items


def test_trials_of_two_experiments_are_refused(results: Path) -> None:
    trials = cyclopean.read_results(results)
    other = trials.assign(experiment="another")
    with pytest.raises(InputError, match=r"2 experiments.*keep one"):
        cyclopean.scores(pd.concat([trials, other]))


@pytest.mark.parametrize("index", [True, False])
def test_trials_saved_as_csv_score_as_their_frame(results: Path, tmp_path: Path, index: bool) -> None:
    trials = cyclopean.read_results(results)
    trials.to_csv(tmp_path / "trials.csv", index=index)
    from_file = cyclopean.scores(tmp_path / "trials.csv", method="firth").to_frame()
    pd.testing.assert_frame_equal(from_file, cyclopean.scores(trials, method="firth").to_frame())


def test_a_frame_without_comparisons_is_refused(results: Path) -> None:
    trials = cyclopean.read_results(results)
    with pytest.raises(InputError, match="no paired comparison"):
        cyclopean.scores(trials[trials["kind"] == "instructions"])
    with pytest.raises(InputError, match="loser"):
        cyclopean.scores(pd.DataFrame({"winner": ["a"]}))


def test_colour_differences_are_those_of_colour_science() -> None:
    first, second, white = np.array([20, 21, 22.0]), np.array([20, 20.5, 22.0]), np.array([95, 100, 108.0])
    white_xy = colour.XYZ_to_xy(white)
    one, other = (colour.XYZ_to_Lab(xyz / 100, white_xy) for xyz in (first, second))
    expected = float(colour.delta_E(one, other, method="CIE 2000"))
    assert cyclopean.delta_e(first, second, white) == pytest.approx(expected)


def test_pictures_come_back_as_they_were_written(tmp_path: Path) -> None:
    left, right = np.random.default_rng(1).uniform(1, 50, (2, 5, 7, 3)).astype(np.float32)
    cyclopean.write_picture(tmp_path / "pair.exr", left, right)
    read = cyclopean.read_picture(str(tmp_path / "pair.exr"))
    np.testing.assert_array_equal(read.left, left.astype(np.float16))
    np.testing.assert_array_equal(read.right, right.astype(np.float16))


def test_a_display_has_a_row_for_each_mode_and_eye() -> None:
    shown = cyclopean.display(ROOT / "configs/displays/asus_vg248qe.yaml")
    frame = shown.to_frame()
    assert list(zip(frame["mode"], frame["eye"], strict=True))[:2] == [
        ("quad-buffered", "left"),
        ("quad-buffered", "right"),
    ]
    # What code 1 gives: Table 3.6 has curves that end at 0.983, 1.082 and 0.991 of Expression 3.12's light.
    assert frame["white_luminance_cd_m2"][0] == pytest.approx(27.88, abs=0.005)
    assert frame["black_luminance_cd_m2"][0] == pytest.approx(0.0055, abs=1e-4)
    assert "<table" in shown._repr_html_()


@pytest.mark.nightly
def test_a_display_is_fitted_to_a_table(tmp_path: Path) -> None:
    from devices.characterise import table_c1_codes, thesis_display

    codes = table_c1_codes()
    table = pd.DataFrame(np.hstack([codes * 255, thesis_display().xyz(codes)]), columns=list("RGBXYZ"))
    table.to_csv(tmp_path / "readings.csv", index=False)
    fitted = cyclopean.fit_display(tmp_path / "readings.csv", "flat", codes="0..255")
    frame = fitted.to_frame()
    assert frame["chosen"].sum() == 1
    assert frame.loc[frame["chosen"], "held_out_delta_e_2000.mean"].item() < 0.1
    panel = cyclopean.display(ROOT / "configs/displays/asus_vg248qe.yaml").value.panel
    fitted.value.write(tmp_path / "display.yaml", panel)
    assert cyclopean.display(tmp_path / "display.yaml").to_frame()["mode"].unique().tolist() == ["flat"]


def test_faults_of_a_file_are_rows(tmp_path: Path) -> None:
    (tmp_path / "display.yaml").write_text("schema_version: 1\nmodes: {}\npanel: {resolution: [1, 2]}\n")
    frame = cyclopean.check(tmp_path / "display.yaml").to_frame()
    assert set(frame["severity"]) == {"error"}
    assert (frame["line"] > 0).any()
    assert frame["remedy"].str.len().max() > 0


def test_a_comparison_has_a_row_for_each_region(tmp_path: Path) -> None:
    light = np.random.default_rng(1).uniform(10, 40, (180, 240, 3))
    cyclopean.write_picture(tmp_path / "plate.exr", light)
    result = cyclopean.compare(tmp_path / "plate.exr", tmp_path / "plate.exr", ROOT / "configs/regions/plate.yaml")
    frame = result.to_frame()
    assert result.value.verdict.decision == "validated"
    assert len(frame) == len(result.value.eyes["both"].table.rows)
    assert frame["delta_e"].max() == 0
    assert {"svg", "img"} < Page(result._repr_html_()).names


def test_stimuli_and_screens(study: Study) -> None:
    made = cyclopean.build(study.folder / "recipe.yaml", study.folder / "rig.yaml")
    assert list(made.to_frame()["name"]) == ["one", "two", "three", "four"]
    assert made.value.load("three").is_flat
    files = cyclopean.preview(study.experiment, study.folder / "screens")
    assert files
    assert all(file.is_file() for file in files)


def test_without_its_extension_power_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "extensions.power", None)
    with pytest.raises(InputError, match="install cyclopean again"):
        cyclopean.power("study.yaml", [5])


def test_power_has_a_row_for_each_number_of_observers(study: Study) -> None:
    done = cyclopean.power(study.experiment, [5, 10], replicates=20)
    assert list(done.to_frame()["observers"]) == [5, 10]
    assert "observers" in repr(done)
    assert done.value.needed.sentence in done._repr_html_()


def test_scores_within_groups_have_a_row_for_each_item_of_each_group() -> None:
    pairs = [pair for pair in ("ab", "ba", "bc", "cb", "ca", "ac", "ab") for _ in range(2)]
    rows = [(*pair, scene, str(person)) for pair in pairs for scene in ("church", "beach") for person in range(3)]
    result = cyclopean.scores(pd.DataFrame(rows, columns=["winner", "loser", "scene", "observer"]))
    assert isinstance(result.value, GroupedScores)
    table = result.to_frame()
    assert table["group"].fillna("").tolist() == ["church"] * 3 + ["beach"] * 3 + [""] * 3
    assert table.groupby(table["group"].fillna(""))["score"].sum().tolist() == pytest.approx([1, 1, 1])
    shown = Page(result._repr_html_())
    assert [tag for tag, _ in shown.tags].count("table") == 3
    assert "church" in shown.text
    # Its style reaches no further than itself.
    assert "<style>.cyclopean {" in result._repr_html_()


def test_results_of_pairs_within_scenes_have_a_pooled_scale_of_what_the_scenes_share(tmp_path: Path) -> None:
    stimuli = tuple(
        {"name": f"{scene}-{codec}", "factors": {"scene": scene, "codec": codec}} for scene in "ab" for codec in "xy"
    )
    for number in ("01", "02", "03"):
        header = new_header("views", number, number, "2026-01-31T09:30:00Z", seed=1, stimuli=stimuli)
        lines = [header.to_json()]
        for place, won in enumerate(["ax", "ay", "ax", "bx", "by", "by"]):
            scene, better = won[0], won[1]
            pair = {"first": f"{scene}-x", "second": f"{scene}-y", "chosen": f"{scene}-{better}"}
            pair |= {"rejected": f"{scene}-{'xy'[better == 'x']}", "group": scene, "group_factor": "scene"}
            pair |= {"answer": "first" if better == "x" else "second"}
            utc = f"2026-01-31T09:31:{place:02d}Z"
            lines.append(new_answer(0, place, "all_pairs", ((better, 1.0),), 1.0, utc, pair).to_json())
        (tmp_path / number).mkdir()
        (tmp_path / number / "session.jsonl").write_text("".join(json.dumps(line) + "\n" for line in lines))
    table = cyclopean.scores(tmp_path).to_frame()
    assert table["group"].fillna("").tolist() == ["a", "a", "b", "b", "", ""]
    assert table["name"].tolist() == ["a-x", "a-y", "b-y", "b-x", "x", "y"]
    assert table["score"].tolist() == pytest.approx([2 / 3, 1 / 3, 2 / 3, 1 / 3, 0.5, 0.5])


def test_the_notebook_has_every_option_of_the_command() -> None:
    from dataclasses import fields

    from runner.cli.main import group
    from runner.reports import ReportOptions, ScoresOptions

    shown = inspect.signature(cyclopean.scores).parameters
    typed = {each.name for each in dict(commands(group))["scores"].params} - {"table", "as_json", "observer_scores"}
    assert typed == {each.name for each in fields(ScoresOptions)} - {"observer_scores"}
    assert typed <= set(shown)
    assert {each.name for each in fields(ReportOptions)} - {"rule"} <= set(
        inspect.signature(cyclopean.report).parameters
    )
    assert str(shown["layout"].annotation) == "str | None"


def test_what_is_asked_beside_scores_is_what_the_command_tells() -> None:
    random = np.random.default_rng(5)
    own = {str(observer): {"a": 0.8, "b": 0.0, "c": -0.8, "d": 0.2} for observer in range(12)}
    lines = []
    for observer, strength in own.items():
        shifted = {item: value + random.normal(0, 0.8) for item, value in strength.items()}
        for first, second in [(a, b) for a in "abcd" for b in "abcd" if a != b]:
            won = random.random() < 1 / (1 + np.exp(shifted[second] - shifted[first]))
            lines.append((first, second, observer) if won else (second, first, observer))
    answers = pd.DataFrame(lines, columns=["winner", "loser", "observer"])
    found = cyclopean.scores(answers, pairs=True, margin="0.5jnd", multiverse=True)
    assert set(found.further) == {"pairs", "equivalence", "multiverse"}
    typical = cyclopean.scores(answers, observers="random")
    assert [*typical.to_frame()["name"]][::3] == ["a", "c"]
    assert cyclopean.scores(answers).further == {}


@pytest.mark.parametrize(
    "options",
    [
        {"modle": "thurstone"},
        {"method": "pwcmp", "pairs": True},
        {"observers": "random", "covariance": "model"},
        {"prior_sd": 2.0},
        {"jod_zero": "a"},
        {"distance_prior": "none"},
    ],
)
def test_options_that_are_none_or_do_not_go_together_are_refused(options: dict[str, Any]) -> None:
    answers = pd.DataFrame({"winner": list("aab"), "loser": list("bba")})
    with pytest.raises(InputError) as caught:
        cyclopean.scores(answers, **options)
    (finding,) = caught.value.findings
    assert next(iter(options)) in finding.message
    assert finding.remedy
