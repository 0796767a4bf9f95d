"""Options of a use case, declared once: the fields of a dataclass, of which commands are made too.

A field's name, type, default and line in the docstring are those of the option; `Typed` says what they do not tell.
"""

from __future__ import annotations

import inspect
import math
from dataclasses import dataclass
from functools import cache


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
