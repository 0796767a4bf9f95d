"""Pairs within scenes in the report: a scale for each, all in one figure, and what they have in common."""

from __future__ import annotations

import csv
import json
import random
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from analysis.comparisons import SessionGroups
from analysis.records import SessionLog, new_header
from analysis.report import Report, common_names, describe
from analysis.report.figures import draw_group_scores
from analysis.report.grouped import GroupedSummary
from analysis.report.groups import _named
from analysis.report.page import render, sections_of, tables_of
from analysis.scaling import fit
from documents.pages import write_csv_files
from documents.pages.blocks import file_names
from tests.answers import altered, new_answer
from tests.kept import known

CODECS = ("jpeg", "avif", "jxl")
SCENES = ("beach", "church", "dune")


def scenes(
    names: Sequence[str] = SCENES, codecs: Sequence[str] = CODECS, best: str = "", factor: str = "codec"
) -> list[SessionLog]:
    """Return sessions of pairs within scenes, as the runner records them; ``best`` always wins."""
    factors = {
        f"{scene} {codec}": {"scene": scene, factor: codec if factor == "codec" else f"{scene} {codec}"}
        for scene in names
        for codec in codecs
    }
    stimuli = tuple({"name": name, "factors": own} for name, own in factors.items())
    pairs = [pair for pair in combinations(factors, 2) if factors[pair[0]]["scene"] == factors[pair[1]]["scene"]]
    sessions = []
    for number in range(1, 7):
        rng = random.Random(number)
        trials = []
        for place, pair in enumerate(rng.sample(pairs * 2, 2 * len(pairs))):
            chosen, rejected = pair if (rng.random() < 0.65 and pair[1] != best) or pair[0] == best else pair[::-1]
            first, second = rng.sample(pair, 2)
            data = {"first": first, "second": second, "chosen": chosen, "rejected": rejected, "first_position": "top"}
            data |= {"answer": "first" if first == chosen else "second"}
            data |= {"group": factors[first]["scene"], "group_factor": "scene"}
            trials.append(new_answer(1, place, "all_pairs", (("up", 1.0),), 1.0, data=data))
        code, began = f"{number:02d}", "2026-01-02T03:04:05Z"
        header = new_header(
            "scenes", code, "s1", began, seed=1, question="Which?", stimuli=stimuli, display={"mode": "flat"}
        )
        sessions.append(SessionLog(Path(f"sub-{code}/session.jsonl"), header, tuple(trials), complete=True))
    return sessions


@cache
def report_of(*, reviewed: bool = False, **options: Any) -> Report:
    """Return the report of `scenes`, made once; what reviewers ask takes most of the time."""
    with pytest.MonkeyPatch.context() as patch:
        if not reviewed:
            patch.setattr("analysis.report.described.group_reviews_of", lambda _: {})
        return describe(scenes(**options))


@cache
def page_of(**options: Any) -> str:
    """Return the report's page."""
    return render(report_of(**options))


def grouped() -> GroupedSummary:
    """Return the groups of the report, which there must be."""
    report = report_of()
    assert report.pairs is None
    return known(report.groups)


def test_each_scene_has_the_scores_of_its_own_answers() -> None:
    sessions, groups = scenes(), grouped()
    assert [name for name, _ in groups.groups] == list(SCENES)
    for scene, part in groups.groups:
        names = [f"{scene} {codec}" for codec in CODECS]
        wins = np.zeros((3, 3))
        for session in sessions:
            for trial in session.trials:
                if trial.details()["chosen"] in names:
                    wins[names.index(trial.details()["chosen"]), names.index(trial.details()["rejected"])] += 1
        expected = dict(zip(names, fit(wins).score.tolist(), strict=True))
        assert {item.name: item.score for item in part.scores.items} == pytest.approx(expected, abs=1e-12)
        assert part.trials == wins.sum() == 36


def test_the_pooled_scale_takes_the_codecs_of_all_scenes_as_one() -> None:
    sessions, groups = scenes(), grouped()
    wins = np.zeros((3, 3))
    for session in sessions:
        for trial in session.trials:
            chosen, rejected = (CODECS.index(trial.details()[key].split()[1]) for key in ("chosen", "rejected"))
            wins[chosen, rejected] += 1
    expected = dict(zip(CODECS, fit(wins).score.tolist(), strict=True))
    assert {item.name: item.score for item in known(groups.pooled).scores.items} == pytest.approx(expected, abs=1e-12)
    assert known(groups.scored.agreement).observers == 6


def test_json_has_the_groups_and_the_pooled_scale() -> None:
    printed = json.loads(json.dumps(report_of().to_json(), allow_nan=False))
    assert [group["name"] for group in printed["groups"]] == list(SCENES)
    assert {"items", "intervals", "stability", "method", "covariance"} <= set(printed["groups"][0])
    assert [item["name"] for item in printed["pooled"]["items"]] == ["jpeg", "avif", "jxl"]
    assert printed["group_factor"] == "scene"
    assert printed["trials"] == 108
    assert "items" not in printed
    assert [line["observer"] for line in printed["observer_table"]["observers"]] == [
        f"{number:02d}" for number in range(1, 7)
    ]


@pytest.mark.usefixtures("undrawn")
def test_every_table_is_there_by_group_and_for_all(tmp_path: Path) -> None:
    report = report_of()
    write_csv_files(tables_of(sections_of(report, {}, {})), tmp_path / "csv")
    files = {file.stem for file in (tmp_path / "csv").iterdir()}
    assert {f"scores_{n:02d}_{name}" for n, name in enumerate(SCENES, 1)} < files
    assert {f"comparisons_{n:02d}_{name}" for n, name in enumerate(SCENES, 1)} < files
    assert {"scores", "classes", "classes_by_group", "groups", "pooled_scores", "pooled_classes"} < files
    with (tmp_path / "csv" / "scores.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(row["group"], row["stimulus"], row["class"]) for row in rows] == [
        (name, item.name, item.label) for name, part in known(report.groups).groups for item in part.scores.items
    ]
    with (tmp_path / "csv" / "classes_by_group.csv").open(newline="") as file:
        assert next(csv.reader(file)) == ["stimulus", "pooled_class", *(f"class in {name}" for name in SCENES)]


def test_groups_of_like_names_keep_their_files_apart() -> None:
    assert file_names(_named("scores", 1, name) for name in ("a b", "a_b", "A_b")) == (
        "scores_01_a_b",
        "scores_01_a_b_2",
        "scores_01_A_b_3",
    )


def test_the_figure_has_a_panel_for_each_group_on_the_same_rows() -> None:
    groups = grouped()
    names = ["jpeg", "avif", "jxl"]
    svg = draw_group_scores(groups.groups, names, groups.common, 7.6).svg
    assert all(svg.count(f">{scene}<") == 1 for scene in SCENES)
    assert all(svg.count(f">{codec}<") == 1 for codec in names)  # beside the first panel of the one row
    assert svg.count(">class<") == 3
    own = draw_group_scores(groups.groups, (), {}, 7.6).svg
    assert all(own.count(f">{scene} {codec}<") == 1 for scene in SCENES for codec in names)


@pytest.mark.usefixtures("undrawn")
def test_one_scene_that_separates_is_named_and_the_others_stay() -> None:
    report = report_of(best="church jxl")
    assert [part.estimate.method for _, part in known(report.groups).groups] == ["ml", "firth", "ml"]
    (note,) = [note for note in report.notes if "complete separation" in note]
    assert note.endswith("in: church.")
    assert "In church, where" in page_of(best="church jxl")


@pytest.mark.usefixtures("undrawn")
def test_stimuli_with_nothing_in_common_have_no_pooled_scale() -> None:
    report = report_of(factor="image")
    assert known(report.groups).pooled is None
    assert known(report.groups).common == {}
    assert report.to_json()["pooled"] is None
    assert "There is no pooled scale" in page_of(factor="image")


def test_observers_of_some_groups_only_are_pointed_out() -> None:
    sessions = scenes(names=SCENES[1:], codecs=("x", "y"))
    only = tuple(trial for trial in sessions[0].answers if trial.details()["group"] == "dune")
    report = describe([replace(sessions[0], records=only), *sessions[1:]])
    assert any("one group only (01)" in note for note in report.notes)


@pytest.mark.parametrize(
    ("factors", "expected"),
    [
        (
            {"a1": {"codec": "x"}, "a2": {"codec": "y"}, "b1": {"codec": "x"}, "b2": {"codec": "y"}},
            ["x", "y", "x", "y"],
        ),
        ({"a1": {"q": 1.5}, "a2": {"q": 2}, "b1": {"q": 1.5}, "b2": {"q": 3}}, ["q 1.5", "q 2", "q 1.5", "q 3"]),
        ({"a1": {"codec": "x"}, "a2": {"codec": "x"}, "b1": {"codec": "x"}, "b2": {"codec": "y"}}, None),
        ({"a1": {"name": "a1"}, "a2": {"name": "a2"}, "b1": {"name": "b1"}, "b2": {"name": "b2"}}, None),
        ({"a1": {}, "a2": {}, "b1": {}, "b2": {}}, None),
    ],
)
def test_common_names_are_the_other_factors_that_recur(
    factors: Mapping[str, Mapping[str, Any]], expected: list[str] | None
) -> None:
    header = scenes()[0].header
    stimuli = [{"name": name, "factors": {"scene": name[0], "view": "flat", **own}} for name, own in factors.items()]
    groups = SessionGroups({name: name[0] for name in factors}, "scene", "")
    names = common_names(altered(header, stimuli=tuple(stimuli)), groups)
    assert names == ({} if expected is None else dict(zip(factors, expected, strict=True)))


@pytest.mark.nightly
def test_groups_are_analysed_in_other_ways_or_the_page_says_why_not() -> None:
    report = report_of(reviewed=True)
    assert set(report.group_reviews) == {"all groups together", *SCENES}
    assert all("multiverse" in own for own in report.group_reviews.values())
    assert all(one.stands is not None for one in report.conclusions)
    assert any("groups' scales" in one.question for one in report.conclusions)
    assert set(report.to_json()["group_reviews"]["dune"]) >= {"pairs", "multiverse"}
    assert "Not made" not in page_of(reviewed=True)
    one_won_all = {"reviewed": True, "best": "church jxl", "names": ("church", "dune")}
    assert "multiverse" not in report_of(**one_won_all).group_reviews["church"]
    assert "church: Other analyses" in page_of(**one_won_all)
    assert "Not made: only a penalty" in page_of(**one_won_all)
