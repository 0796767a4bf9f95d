"""The groups that the comparisons of an experiment fall into, and those that are linked after all."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import pytest

from analysis.comparisons import SessionGroups, from_sessions, grouped_comparisons
from analysis.kinds import Trial
from analysis.records import SessionLog
from tests.answers import altered, changed

Maker = Callable[..., SessionLog]
FACTORS: Mapping[str, Mapping[str, Any]] = {
    f"{scene}-{codec}": {"image": f"{scene}-{codec}", "codec": codec, "scene": scene}
    for scene in ("beach", "church", "dune")
    for codec in ("jpeg", "avif")
}
WITHIN = [(f"{scene}-jpeg", f"{scene}-avif") for scene in ("beach", "church", "dune")]


def study(
    make_session: Maker,
    pairs: Sequence[tuple[str, str]],
    *,
    block: Callable[[int], int] = lambda number: 1,
    labels: Sequence[str | None] | None = None,
    factors: Mapping[str, Mapping[str, Any]] = FACTORS,
) -> SessionLog:
    """Return a session with an answer for each pair; ``labels`` are what the trials say of their groups."""
    session = make_session(names=list(factors), answers=pairs)
    stimuli = tuple({**stimulus.given(), "factors": factors[stimulus.name]} for stimulus in session.header.stimuli)
    trials = []
    for number, trial in enumerate(session.trials):
        label = labels[number] if labels else None
        group = {} if label is None else {"group": label, "group_factor": "scene"}
        trials.append(changed(trial, block=block(number), data={**trial.details(), **group}))
    return replace(session, header=altered(session.header, stimuli=stimuli), answers=tuple(trials))


def groups_of(session: SessionLog) -> SessionGroups:
    """Return the groups, which there must be."""
    _, groups = grouped_comparisons([session])
    assert groups is not None
    return groups


def test_pairs_within_scenes_make_a_group_of_each(make_session: Maker) -> None:
    session = study(make_session, WITHIN * 2, labels=["beach", "church", "dune"] * 2)
    comparisons, groups = grouped_comparisons([session])
    assert comparisons.groups == ("beach", "church", "dune")
    assert [comparisons.items[number][:3] for number in comparisons.winner] == ["bea", "chu", "dun"] * 2
    assert comparisons.group.tolist() == [0, 1, 2] * 2
    assert groups is not None
    assert groups.factor == "scene"
    assert groups.group_of == {name: name.split("-")[0] for name in FACTORS}
    assert groups.sentence.startswith("Only stimuli with the same scene were compared (3 groups: beach, church, dune).")


def test_pairs_between_scenes_leave_one_scale(make_session: Maker) -> None:
    links = [("beach-jpeg", "church-jpeg"), ("church-jpeg", "dune-jpeg")]
    session = study(make_session, WITHIN + links, labels=["beach", "church", "dune", None, None])
    comparisons, groups = grouped_comparisons([session])
    assert groups is None
    assert comparisons.groups == ()


def test_another_block_links_some_of_the_scenes(make_session: Maker) -> None:
    pairs = [*WITHIN, ("beach-jpeg", "dune-jpeg")]
    session = study(make_session, pairs, labels=["beach", "church", "dune", None], block=lambda n: n // 3)
    groups = groups_of(session)
    assert groups.factor is None
    assert groups.names == ("beach + block 2 + dune", "church")


@pytest.mark.parametrize("first", ["codec", "scene"])
def test_blocks_of_other_stimuli_are_told_apart_by_a_factor(make_session: Maker, first: str) -> None:
    """Results from before trials named their group, or two blocks that the experiment lists stimuli for."""
    pairs = WITHIN[:2] if first == "scene" else [("beach-jpeg", "church-jpeg"), ("beach-avif", "church-avif")]
    groups = groups_of(study(make_session, pairs, block=lambda number: number + 3))
    assert groups.factor == first
    assert groups.names == tuple(pair[0].split("-")[first == "codec"] for pair in pairs)


def test_blocks_that_no_factor_tells_apart_are_named_by_number(make_session: Maker) -> None:
    pairs = [("beach-jpeg", "church-avif"), ("beach-avif", "church-jpeg")]
    groups = groups_of(study(make_session, pairs, block=lambda number: number + 3))
    assert groups.factor is None
    assert groups.names == ("block 4", "block 5")
    assert "they fall into 2 groups, named by block: block 4, block 5." in groups.sentence


def test_answers_that_are_missing_make_no_groups(make_session: Maker) -> None:
    """One block compares all its stimuli: a session that ended early is no study of two groups."""
    session = study(make_session, [("beach-jpeg", "beach-avif"), ("dune-jpeg", "dune-avif")])
    assert grouped_comparisons([session])[1] is None
    assert from_sessions([session]).groups == ()


def test_two_sets_of_one_scene_have_names_of_their_own(make_session: Maker) -> None:
    factors = {name: {"scene": "church"} for name in "abcd"}
    pairs = [("a", "b"), ("c", "d")]
    session = study(make_session, pairs, labels=["church"] * 2, block=lambda number: number, factors=factors)
    assert groups_of(session).names == ("church (a)", "church (c)")


def test_the_factor_that_the_experiment_named_comes_before_others(make_session: Maker) -> None:
    factors = {name: {"light": name[0], "scene": f"{name[0]}!"} for name in ("a1", "a2", "b1", "b2")}
    session = study(make_session, [("a1", "a2"), ("b1", "b2")], labels=["a!", "b!"], factors=factors)
    assert groups_of(session).factor == "scene"


def test_levels_that_are_numbers_are_named_as_words(make_session: Maker) -> None:
    factors = {f"{name}{level}": {"exposure_s": level} for level in (1.5, 2) for name in "ab"}
    session = study(make_session, [("a1.5", "b1.5"), ("a2", "b2")], labels=["1.5", "2"], factors=factors)
    assert groups_of(session).names == ("1.5", "2")


def test_ties_link_the_stimuli_of_a_scene(make_session: Maker) -> None:
    session = study(make_session, WITHIN, labels=["beach", "church", "dune"])
    tie = session.trials[0]
    tied: Trial = changed(tie, data={k: v for k, v in tie.details().items() if k not in ("chosen", "rejected")})
    tied = changed(tied, data={**tied.details(), "answer": "no_difference"})
    comparisons = from_sessions([replace(session, answers=(tied, *session.trials[1:]))])
    assert set(comparisons.groups) == {"beach", "church", "dune"}
    assert comparisons.ties == 1
