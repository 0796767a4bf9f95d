"""Options of a use case, declared once: the fields of a dataclass, of which commands are made too.

A field's name, type, default and line in the docstring are those of the option; `Typed` says what they do not tell.
"""

from __future__ import annotations

import ast
import importlib
import importlib.util
import inspect
import math
import re
import sys
import types
from collections import ChainMap
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import Field, dataclass, field, fields, is_dataclass, make_dataclass
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

from documents.findings import Finding, InputError
from documents.text.words import did_you_mean

Made = TypeVar("Made")
_WRITTEN = Literal, Sequence  # what annotations of parameters name, beside what is used here


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
    place
        Whether it is typed without a flag although it has a default.
    """

    flag: str = ""
    metavar: str | None = None
    least: float = -math.inf
    most: float = math.inf
    above: bool = False
    between: str = ","
    value: str | None = None
    read: str = ""
    place: bool = False


MONITOR = Typed("--monitor", "NAME|NUMBER")
MONITOR_WORDS = (
    "Monitor for the window, as `cyclopean doctor` lists them; twice for dual-window, the left eye's first. "
    "Default: the rig's, else the first of the panel's resolution."
)


@cache
def described(kind: type) -> dict[str, str]:
    """Return what the docstring of a dataclass says of each field, and of those it inherits: of ``a, b`` the same.

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
    inherited = ChainMap(*(described(base) for base in kind.__bases__ if is_dataclass(base)))
    return {**inherited, **{name: " ".join(text) for name, text in told.items()}}


@cache
def parameters_of(function: str) -> Any:
    """Return a dataclass with the parameters of a function, by its full name, and with its docstring.

    They are read from the source, so that help appears before what the function needs is imported; defaults must be
    plain values. ``taken`` is the full name of the dataclass of its parameter ``options``, ``several`` what takes any
    number of values; empty if it has none.

    Examples
    --------
    >>> [each.name for each in fields(parameters_of("documents.options.read_text"))]
    ['function', 'text']
    """
    module, _, name = function.rpartition(".")
    # `importlib.abc` names such loaders, and takes a tenth of the time of a start to import.
    source_of = getattr(getattr(importlib.util.find_spec(module), "loader", None), "get_source", None)
    tree = ast.parse((source_of and source_of(module)) or "")
    parts = {part.name: part for part in tree.body if isinstance(part, ast.FunctionDef)}
    own = [part for part in ast.walk(tree) if isinstance(part, ast.ImportFrom)]
    whole = {alias.name: f"{part.module}.{alias.name}" for part in own for alias in part.names}
    given, options = parts[name].args, ""
    several = [given.vararg] if given.vararg else []
    defaults = [None] * (len(given.args) - len(given.defaults)) + given.defaults + [None for _ in several]
    found = []
    for each, default in zip(given.args + several + given.kwonlyargs, defaults + given.kw_defaults, strict=True):
        of = ast.unparse(each.annotation) if each.annotation else "Any"
        if each.arg == "options":
            options = whole[of.removesuffix(" | None")]
        found.append((each.arg, of, field(default=_plain_value(default)) if default else field()))
    about = {"__doc__": ast.get_docstring(parts[name]), "taken": options, "__module__": __name__}
    about["several"] = several[0].arg if several else ""
    return make_dataclass(name, found, namespace=about, kw_only=True)


def _plain_value(default: ast.expr) -> Any:
    try:
        return ast.literal_eval(default)
    except ValueError:  # of what is no option, such as a function that is called
        return None


def type_of(kind: type[Any], field: Field[Any]) -> tuple[Typed, Any, bool]:
    """Return what a field's annotation says of how it is typed, its type without None, and whether None is one."""
    # An inherited field is written with the names of the module of its own class.
    of: Any = _evaluated(field, dict(ChainMap(*(vars(sys.modules[each.__module__]) for each in kind.__mro__))))
    typed = Typed()
    if get_origin(of) is Annotated:
        of, *marks = get_args(of)
        typed = next((mark for mark in marks if isinstance(mark, Typed)), typed)
    optional = False
    if get_origin(of) in (Union, types.UnionType):
        optional = type(None) in get_args(of)
        kinds = [each for each in get_args(of) if each is not type(None)]
        of = Path if Path in kinds else kinds[0]
        if get_origin(of) is Literal and str in kinds:
            of = of | str
    return typed, of, optional


def _evaluated(field: Field[Any], names: dict[str, Any]) -> Any:
    """Return a field's type; what its module does not import where the program runs may be anything."""
    alone = types.SimpleNamespace(__annotations__={field.name: field.type})
    try:
        return get_type_hints(alone, names, include_extras=True)[field.name]
    except NameError as error:
        return _evaluated(field, names | {str(error.name): Any})


def read_text(function: str, text: str) -> Any:
    """Return what a function, by its full name as `Typed` has it, makes of a text."""
    module, _, name = function.rpartition(".")
    return getattr(importlib.import_module(module), name)(text)


def names_of(text: str) -> tuple[str, ...]:
    """Return names with commas between."""
    return tuple(name.strip() for name in text.split(","))


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


def option_names(kind: type) -> list[str]:
    """Return the names of the fields of a dataclass, and in place of a field that is one itself those of its own."""
    return [each.name for each in _parameters(kind)]


def made(kind: type[Made], options: Mapping[str, Any]) -> Made:
    """Return ``kind`` made of ``options``, those of dataclasses in it among them; a text may stand for a path.

    So it may for what the command line reads of a text, such as a camera for its file.

    Raises
    ------
    InputError
        If one of them is no field of it, or a text cannot be read.
    """
    known = option_names(kind)
    if unknown := next((name for name in options if name not in known), None):
        raise InputError(Finding(f"there is no option '{unknown}'", remedy=did_you_mean(unknown, known)))
    return _made(kind, options)


def _made(kind: type[Made], options: Mapping[str, Any]) -> Made:
    values: dict[str, Any] = {name: _made(of, options) for name, of in _inner(kind).items()}
    values |= {each.name: _read(kind, each, options[each.name]) for each in fields(kind) if each.name in options}  # type: ignore[arg-type]  # a dataclass
    return kind(**values)


def _read(kind: type, field: Field[Any], value: Any) -> Any:
    """Return a value with what is meant by the texts in it: paths, where the field is of paths alone."""
    typed, of, _ = type_of(kind, field)
    if typed.read and isinstance(value, str | Path):
        try:
            return read_text(typed.read, str(value))
        except ValueError as error:
            raise InputError(Finding(f"the option '{field.name}' is '{value}': {error}")) from None
    if of is Path and isinstance(value, str) and "str" not in str(field.type):
        return Path(value)
    return tuple(map(Path, value)) if get_args(of)[:1] == (Path,) and isinstance(value, list | tuple) else value


def _plain(annotation: Any) -> Any:
    """Return a type as it is written, without how it is typed on the command line."""
    return (
        re.sub(r"^Annotated\[(.*), \w+(?:\(.*\))?\]$", r"\1", annotation) if isinstance(annotation, str) else annotation
    )
