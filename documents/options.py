"""Options of a use case, declared once: the fields of a dataclass, of which commands are made too.

A field's name, type, default and line in the docstring are those of the option; `Typed` says what they do not tell.
"""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, fields, is_dataclass
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

from documents.findings import Finding, InputError
from documents.text.words import did_you_mean

Made = TypeVar("Made")


@dataclass(frozen=True, slots=True)
class Typed:
    """How a field is typed on the command line, in its ``Annotated`` type.

    Attributes
    ----------
    flag
        What is typed, where that is not the field's name: ``--white``, ``--fit/--no-fit``, or ``-o --output``.
    metavar
        What stands for the value in the help.
    least, most
        Between what a number lies.
    above
        Whether it lies above ``least``, which is then left out.
    between
        What stands between several numbers in one word.
    value
        What the field is where the flag, which then takes no value, is typed.
    read
        The function that makes the value of the text, by its full name: ``devices.camera.read_camera``.
    """

    flag: str = ""
    metavar: str | None = None
    least: float = -math.inf
    most: float = math.inf
    above: bool = False
    between: str = ","
    value: str | None = None
    read: str = ""


MONITOR = Typed("--monitor", "NAME|NUMBER")
MONITOR_WORDS = (
    "Monitor for the window, as `cyclopean doctor` lists them; twice for dual-window, the left eye's first. "
    "Default: the rig's, else the first of the panel's resolution."
)


@cache
def described(kind: type) -> dict[str, str]:
    """Return what the docstring of a dataclass says of each field: of ``alpha, adjust`` the same of both.

    Examples
    --------
    >>> described(Typed)["metavar"]
    'What stands for the value in the help.'
    """
    lines = inspect.cleandoc(kind.__doc__ or "").splitlines()
    titles = ("Attributes", "Parameters")
    start = next((place for place, line in enumerate(lines) if line in titles), len(lines))
    told: dict[str, list[str]] = {}
    names: list[str] = []
    for line in lines[start + 2 :]:
        if line and not line.startswith(" "):
            names = [name.strip() for name in line.split(",")]
        for name in names if line.startswith(" ") else ():
            told.setdefault(name, []).append(line.strip())
    return {name: " ".join(text) for name, text in told.items()}


Function = TypeVar("Function", bound=Callable[..., Any])


def taking(kind: type, *leave_out: str) -> Callable[[Function], Function]:
    """Return what lets a function with ``**options`` show the fields of a dataclass as keywords of its own.

    A field that is such a dataclass itself stands for its fields.
    """

    def add(function: Function) -> Function:
        signature = inspect.signature(function)
        own = [each for each in signature.parameters.values() if each.kind is not inspect.Parameter.VAR_KEYWORD]
        names = {each.name for each in own} | set(leave_out)
        more = [each for each in _parameters(kind) if each.name not in names]
        vars(function)["__signature__"] = signature.replace(parameters=[*own, *more])
        return function

    return add


def _parameters(kind: type) -> Iterator[inspect.Parameter]:
    for name, each in inspect.signature(kind).parameters.items():
        if inner := _inner(kind).get(name):
            yield from _parameters(inner)
        else:
            yield each.replace(kind=inspect.Parameter.KEYWORD_ONLY, annotation=_plain(each.annotation))


def _inner(kind: type) -> dict[str, type]:
    """Return the fields that are dataclasses themselves."""
    nested = [one for one in fields(kind) if is_dataclass(one.default_factory)]
    return {one.name: one.default_factory for one in nested}  # type: ignore[misc]  # a class, as was just asked


def made(kind: type[Made], options: Mapping[str, Any]) -> Made:
    """Return ``kind`` made of ``options``, those of dataclasses in it among them; a text may stand for a path.

    Raises
    ------
    InputError
        If one of them is no field of it.
    """
    known = [each.name for each in _parameters(kind)]
    if unknown := next((name for name in options if name not in known), None):
        raise InputError(Finding(f"there is no option '{unknown}'", remedy=did_you_mean(unknown, known)))
    return _made(kind, options)


def _made(kind: type[Made], options: Mapping[str, Any]) -> Made:
    values: dict[str, Any] = {name: _made(of, options) for name, of in _inner(kind).items()}
    own = inspect.signature(kind).parameters
    values |= {name: _as_paths(own[name].annotation, value) for name, value in options.items() if name in own}
    return kind(**values)


def _as_paths(annotation: Any, value: Any) -> Any:
    """Return a value with paths for the texts in it, where the field is of paths alone."""
    if "Path" not in str(annotation) or "str" in str(annotation):
        return value
    return Path(value) if isinstance(value, str) else tuple(map(Path, value)) if isinstance(value, list) else value


def _plain(annotation: Any) -> Any:
    """Return a type as it is written, without how it is typed on the command line."""
    return (
        re.sub(r"^Annotated\[(.*), \w+(?:\(.*\))?\]$", r"\1", annotation) if isinstance(annotation, str) else annotation
    )
