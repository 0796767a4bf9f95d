"""Reading options from a mapping, as a YAML file gives it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

from documents import Finding
from documents.text.words import did_you_mean
from runner.presenter.errors import PresentationError

Read: TypeAlias = Callable[[Any], Any]  # raises ValueError with what was expected


def flag(value: Any) -> bool:
    """Return ``value`` if it is true or false."""
    if not isinstance(value, bool):
        raise ValueError("expected true or false")
    return value


def pair_px(value: Any) -> tuple[int, int]:
    """Return two whole numbers."""
    whole = isinstance(value, list | tuple) and [type(part) for part in value] == [int, int]
    if not whole:
        raise ValueError("expected two whole numbers of pixels, such as [3, -2]")
    return value[0], value[1]


def positive_px(value: Any) -> int:
    """Return a whole number above 0."""
    if type(value) is not int or value < 1:
        raise ValueError("expected a whole number of pixels above 0")
    return value


def one_of(choices: Mapping[str, Any]) -> Read:
    """Return a reader of one of the names in ``choices``."""

    def read(value: Any) -> Any:
        if not isinstance(value, str) or value not in choices:
            raise ValueError(did_you_mean(str(value), choices))
        return choices[value]

    return read


def read_options(options: Mapping[str, Any], readers: Mapping[str, Read]) -> dict[str, Any]:
    """Return the values of ``options`` by their ``readers``.

    Raises
    ------
    PresentationError
        With a finding for every fault.
    """
    values: dict[str, Any] = {}
    findings: list[Finding] = []
    for key, value in options.items():
        if key not in readers:
            findings.append(Finding(f"unknown mode option '{key}'", remedy=did_you_mean(str(key), readers)))
            continue
        try:
            values[key] = readers[key](value)
        except ValueError as error:
            findings.append(Finding(f"the mode option '{key}' is {value!r}", remedy=str(error)))
    if findings:
        raise PresentationError(findings)
    return values
