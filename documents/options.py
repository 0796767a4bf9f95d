"""Options of a use case, declared once: the fields of a dataclass, of which commands are made too.

A field's name, type, default and line in the docstring are those of the option; `Typed` says what they do not tell.
"""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
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
        What is typed, where that is not the field's name: ``--white``, or ``--fit/--no-fit``.
    metavar
        What stands for the value in the help.
    least, most
        Between what a number lies.
    above
        Whether it lies above ``least``, which is then left out.
    """

    flag: str = ""
    metavar: str | None = None
    least: float = -math.inf
    most: float = math.inf
    above: bool = False


MONITOR = Typed("--monitor", "NAME|NUMBER")


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
    """Return what lets a function with ``**options`` show the fields of a dataclass as keywords of its own."""

    def add(function: Function) -> Function:
        signature = inspect.signature(function)
        own = [each for each in signature.parameters.values() if each.kind is not inspect.Parameter.VAR_KEYWORD]
        names = {each.name for each in own} | set(leave_out)
        of_kind = inspect.signature(kind).parameters.values()
        more = [
            each.replace(kind=inspect.Parameter.KEYWORD_ONLY, annotation=_plain(each.annotation))
            for each in of_kind
            if each.name not in names
        ]
        vars(function)["__signature__"] = signature.replace(parameters=[*own, *more])
        return function

    return add


def made(kind: Callable[..., Made], options: Mapping[str, Any]) -> Made:
    """Return ``kind`` made of ``options``.

    Raises
    ------
    InputError
        If one of them is no field of it.
    """
    known = inspect.signature(kind).parameters
    if unknown := next((name for name in options if name not in known), None):
        raise InputError(Finding(f"there is no option '{unknown}'", remedy=did_you_mean(unknown, known)))
    return kind(**options)


def _plain(annotation: Any) -> Any:
    """Return a type as it is written, without how it is typed on the command line."""
    return (
        re.sub(r"^Annotated\[(.*), \w+(?:\(.*\))?\]$", r"\1", annotation) if isinstance(annotation, str) else annotation
    )
