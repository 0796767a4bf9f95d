"""Every option of every command says what it is for."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import click
import pytest

from runner.cli.main import group
from runner.cli.options import Whole, Within
from tests.runner.cli.every_command import commands


def test_every_option_has_help() -> None:
    options = [
        (called, one)
        for called, each in commands(group, "cyclopean")
        for one in each.params
        if isinstance(one, click.Option)
    ]
    assert ("cyclopean run", "results") in [(called, one.name) for called, one in options]
    assert [f"{called} {one.opts[0]}" for called, one in options if not one.help] == []


def _numbers() -> Iterator[tuple[str, click.Option, click.ParamType[Any]]]:
    """Yield each number that an option takes, those of several at once too."""
    for called, each in commands(group, "cyclopean"):
        for one in each.params:
            if isinstance(one, click.Option):
                for kind in one.type.types if isinstance(one.type, click.Tuple) else (one.type,):
                    if isinstance(kind, click.types.IntParamType | click.types.FloatParamType):
                        yield called, one, kind


def test_every_number_of_an_option_has_a_range() -> None:
    numbers = list(_numbers())
    assert len(numbers) > 50
    assert [f"{called} {one.opts[0]}" for called, one, kind in numbers if not _has_range(kind)] == []


def _has_range(kind: click.ParamType[Any]) -> bool:
    limits = (kind.min, kind.max) if isinstance(kind, click.IntRange) else (None,)
    return isinstance(kind, Within | Whole) or None not in limits


@pytest.mark.parametrize("word", ["nan", "inf", "-inf", "1e999", "9" * 5000, "-" + "9" * 5000, "x"])
def test_what_is_no_number_that_anybody_means_is_refused(word: str) -> None:
    kinds = {id(kind): kind for _, _, kind in _numbers()}
    for kind in kinds.values():
        with pytest.raises(click.BadParameter):
            kind.convert(word, None, None)


def test_numbers_within_the_range_are_taken() -> None:
    above, seed = Within(0, 1e12, min_open=True), Whole(0, 10**40)
    assert (above.convert("1e-9", None, None), seed.convert(str(2**64), None, None)) == (1e-9, 2**64)
    for kind, word in ((above, "0"), (seed, "-1")):
        with pytest.raises(click.BadParameter):
            kind.convert(word, None, None)


def test_observers_and_limits_are_refused_in_words(cyclopean: Callable[..., Any]) -> None:
    for words in (("--observers", "9" * 5000), ("--observers", "1-100000000"), ("--observers", "1e999")):
        told = cyclopean("power", "experiments/dynamic_range.yaml", *words, expect=2)
        assert told.stderr.splitlines()[-1].startswith(("Error: ", "error: "))
