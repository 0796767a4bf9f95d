"""Experiments with blocks of all kinds mixed, for property tests: names that are traps, factors that hardly differ."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from typing import Any

from hypothesis import strategies as st

# Small pools, so that names clash: with each other, with the program's own words, and with those of records.
_STIMULI = (
    *("a", "b", "first", "second", "stereo", "flat", "one", "1.1", "chosen", "none", "A-b", "same", "no"),
    "no_difference",
)
_FACTORS = ("scene", "codec", "level", "level", "paint", "group", "name")
_LEVELS = ("x", "y", "a", "one", "stereo", "flat", 0, 1, 2.5, 1e-9, 1.0000001)
_NAMES = ("one", "two", "a", "first", "x-y", "quality", "Größe", "1", "a | b", "<b>", "=1+1")
_LABELS = ("quality", "similarity", "difficulty", "age", "gloss", "first", "answer", "rating", "stimulus")
_MODES = ("flat", "side-by-side", "anaglyph-red-cyan", "row-interleaved")


def _maybe(draw: st.DrawFn, entry: dict[str, Any], **keys: st.SearchStrategy[Any]) -> dict[str, Any]:
    """Return ``entry`` with some of ``keys``."""
    return entry | {key: draw(values) for key, values in keys.items() if draw(st.integers(0, 3)) == 0}


_SCALES = st.builds(
    lambda name, lowest, length, confirm: {
        "name": name,
        "question": "How good",
        "lowest": lowest,
        "highest": lowest + length,
        "confirm": confirm,
    },
    st.sampled_from(_LABELS),
    st.sampled_from([-3, 0, 1]),
    st.sampled_from([1, 4, 20]),
    st.booleans(),
)
_RATINGS = st.lists(_SCALES, min_size=1, max_size=2, unique_by=lambda scale: scale["name"])
_TIMES = {"exposure_s": st.just(0.2), "fixation_s": st.just(0.1), "blank_s": st.just(0.1)}
_QUESTIONS = st.lists(
    st.one_of(
        st.builds(
            lambda name: {"kind": "number", "name": name, "question": "How many", "lowest": 1}, st.sampled_from(_LABELS)
        ),
        st.builds(
            lambda name, options: {"kind": "choice", "name": name, "question": "Which", "options": options},
            st.sampled_from(_LABELS),
            st.lists(st.sampled_from(_NAMES), min_size=2, max_size=3, unique=True),
        ),
        st.builds(
            lambda name, required: {"kind": "text", "name": name, "question": "What", "required": required},
            st.sampled_from(_LABELS),
            st.booleans(),
        ),
    ),
    min_size=1,
    max_size=3,
    unique_by=lambda question: question["name"],
)
_TESTS: tuple[dict[str, Any], ...] = (
    {"test": "stereo_acuity", "pass_arcsec": 200, "levels_arcsec": [400, 200], "repeats": 2, "required": 1},
    {"test": "near_acuity", "pass_logmar": 0.5, "levels_logmar": [0.6, 0.5], "repeats": 2, "required": 2},
    {"test": "colour_vision", "pass_delta_uv": 0.03, "levels_delta_uv": [0.05, 0.03], "controls": 1},
)


@st.composite
def blocks(draw: st.DrawFn, names: list[str], factors: list[str], nested: bool = False) -> dict[str, Any]:
    """Draw a block on stimuli of ``names`` and ``factors``; ``nested`` in another."""
    some = st.one_of(st.just("all"), st.lists(st.sampled_from(names), min_size=2, unique=True))
    pair = st.lists(st.sampled_from(names), min_size=2, max_size=2, unique=True)
    factor = st.sampled_from(factors or ["scene"])
    every = {"break_every": st.integers(1, 3)}
    kinds = ["all_pairs", "active_pairs", "best_of_series", "rating", "preference", "screening", "threshold"]
    kind = draw(st.sampled_from(kinds + ["instructions", "break", "questionnaire", "practice"] * (not nested)))
    entry: dict[str, Any] = {"kind": kind}
    if kind in ("instructions", "break"):
        return entry | {"text": "Look."}
    if kind == "questionnaire":
        return entry | {"questions": draw(_QUESTIONS)}
    if kind == "screening":
        tests = draw(st.lists(st.sampled_from(_TESTS), min_size=1, max_size=2, unique_by=lambda test: test["test"]))
        return entry | {
            "tests": tests,
            "on_fail": "continue" if nested else draw(st.sampled_from(["continue", "stop"])),
        }
    if kind == "practice":
        entry |= {"trials": draw(st.integers(1, 4)), "block": draw(blocks(names, factors, nested=True))}
        until = st.just({"correct": 0.5, "of": 1})
        return _maybe(draw, entry, feedback=st.sampled_from(["correctness", "choice", "none"]), until=until)
    if kind == "best_of_series":
        by_name = st.dictionaries(
            st.sampled_from(_NAMES), st.lists(st.sampled_from(names), min_size=2, unique=True), min_size=1, max_size=2
        )
        by_factors = st.builds(
            lambda by, order: {"by": by, "order": order}, st.lists(factor, min_size=1, max_size=2, unique=True), factor
        )
        entry["series"] = draw(st.one_of(by_name, by_name, by_factors))
        return _maybe(
            draw,
            entry,
            ratings=st.one_of(st.just([]), _RATINGS),
            see_all=st.just(False),
            wrap=st.just(True),
            start=st.just("first"),
            **every,
        )
    if kind == "rating":
        entry["ratings"] = draw(_RATINGS)
        return _maybe(draw, entry, stimuli=some, repeats=st.just(2), **_TIMES, **every)
    if kind == "preference":
        presentation = st.sampled_from(["sequence", "simultaneous"])
        pairs = st.one_of(st.just("all"), st.lists(pair, min_size=1, max_size=2))
        return _maybe(draw, entry | {"pairs": draw(pairs)}, presentation=presentation, exposure_s=st.just(0.2), **every)
    if kind == "threshold":
        task = draw(st.sampled_from(["yes_no", "two_intervals", "two_places"]))
        entry |= {"factor": "level", "task": task, "trials": draw(st.integers(1, 6))}
        if task != "yes_no" or draw(st.booleans()):
            entry |= {"reference": draw(st.sampled_from(names))}
        if task == "two_intervals":
            entry |= {"exposure_s": 0.2}
        if task == "yes_no" and "reference" in entry:
            entry |= {"catch_share": draw(st.sampled_from([0, 0.3]))}
        staircase = {"kind": "staircase", "up": 1, "start": ["above", "below"]}
        return _maybe(
            draw,
            entry,
            within=factor,
            method=st.sampled_from([{"kind": "quest_plus", "tracks": 2}, staircase]),
            easier=st.just("lower"),
            function=st.sampled_from(["logistic", "normal"]),
            **every,
        )
    ties = {"ties": st.sampled_from(["both", "no_difference", "not_sure"])}
    if kind == "active_pairs":
        entry["trials"] = draw(st.integers(3, 12))
        gain = st.sampled_from(["entropy", "variance"])
        return _maybe(draw, entry, stimuli=some, within=factor, batch=st.just(1), gain=gain, **ties, **every, **_TIMES)
    catch = st.builds(
        lambda pairs, identical: {"pairs": pairs, "identical": identical}, st.lists(pair, max_size=2), st.integers(0, 1)
    )
    sequence = st.just("sequence")
    entry = _maybe(
        draw, entry, stimuli=some, within=factor, catch=catch, presentation=sequence, **ties, **every, **_TIMES
    )
    if "within" in entry:
        entry = _maybe(draw, entry, across=factor)
    if entry.get("presentation") == "sequence":
        entry["exposure_s"] = 0.2
    ratings = st.lists(
        _SCALES.flatmap(lambda scale: st.sampled_from([scale, {**scale, "of": "both"}])), min_size=1, max_size=2
    )
    return _maybe(draw, entry, repeats=st.just(2), ratings=ratings)


_MORE: dict[str, st.SearchStrategy[Any]] = {
    "style": st.sampled_from(
        [{"progress": "bar"}, {"progress": "count", "end_page": True}, {"background": {"share_of_white": 0.3}}]
    ),
    "keys": st.sampled_from([{"left": ["1"], "right": ["4"]}, {"n": ["x"]}, {"space": ["tab"]}]),
    "words": st.sampled_from([{"language": "de"}, {"language": "fr", "press_space": "Suite : {space}"}]),
    "analysis": st.sampled_from(
        [
            {"alpha": 0.5, "adjust": "none"},
            {"adjust": "maxz", "covariance": "model"},
            {"covariance": "sandwich", "margin": "0.5jnd"},
            {"adjust": "bh", "covariance": "scaled", "margin": "55:45"},
        ]
    ),
    "seed": st.integers(-3, 3),
}


@st.composite
def mixed_experiments(draw: st.DrawFn) -> dict[str, Any]:
    """Draw an experiment of several blocks, as `generated_experiments.write` takes it."""
    names = draw(st.lists(st.sampled_from(_STIMULI), min_size=2, max_size=6, unique=True))
    factors = draw(st.lists(st.sampled_from(_FACTORS), max_size=4, unique=True))
    stimuli = {
        name: {factor: number if factor == "level" else draw(st.sampled_from(_LEVELS)) for factor in factors}
        for number, name in enumerate(names)
    }
    tie = {"width": draw(st.sampled_from([0.0, 1.0, 1e6]))}
    behaviour = {"ties": tie, "lapse_rate": draw(st.sampled_from([0.0, 0.5, 1.0]))}
    mode = draw(st.sampled_from(_MODES))
    return {
        "panel": (1280, 720),
        "mode": mode,
        "stereo": mode != "flat" and draw(st.booleans()),
        "question": draw(st.sampled_from(["Which?", "Größer als <b>?", "a\\b"])),
        "layout": {
            "arrangement": draw(st.sampled_from(["vertical", "horizontal"])),
            "size_mm": [5, 4],
            "gap_mm": 1,
            "reference": draw(st.sampled_from(["none", "physical", names[-1]])),
        },
        "stimuli": stimuli,
        "behaviour": behaviour,
        "more": _maybe(draw, {}, **_MORE),
        "blocks": draw(st.lists(blocks(names, factors), min_size=1, max_size=4)),
    }


# What stands in place of a value, or beside one: of every type, at limits, and the words of records.
_VALUES: tuple[Any, ...] = (
    *(0, 1, 2, 3, 7, -1, 0.05, 0.5, 1e-9, 1e9, True, False, None, "", [], {}, [[]], {"a": 1}),
    *("a", "first", "all", "none", "both", "level", "scene", "one", "sequence", "stop", "x" * 301, "{space}", "\u202e"),
)


@st.composite
def mutants(draw: st.DrawFn) -> dict[str, Any]:
    """Draw an experiment that was edited by someone who knows no rules: values exchanged, copied, removed, doubled."""
    drawn = draw(mixed_experiments())
    said = copy.deepcopy({key: drawn[key] for key in ("question", "layout", "blocks", "more")})
    for _ in range(draw(st.sampled_from([1, 1, 2]))):
        places = list(_places(said))
        inside, key = draw(st.sampled_from(places))
        how = draw(st.sampled_from(["value", "copy", "remove", "double"]))
        if how == "remove" and (inside is not said):
            del inside[key]
        elif how == "double" and isinstance(inside, list):
            inside.insert(key, copy.deepcopy(inside[key]))
        elif how == "copy":
            other, other_key = draw(st.sampled_from(places))
            inside[key] = copy.deepcopy(other[other_key])
        else:
            inside[key] = copy.deepcopy(draw(st.sampled_from(_VALUES)))
    if not isinstance(said["more"], dict):
        said["more"] = {}
    return drawn | said


def _places(value: Any) -> Iterator[tuple[Any, Any]]:
    """Yield each mapping and list within ``value`` with each of its keys."""
    if isinstance(value, dict | list):
        for key in list(value) if isinstance(value, dict) else range(len(value)):
            yield value, key
            yield from _places(value[key])
