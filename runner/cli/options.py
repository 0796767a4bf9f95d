"""The options of a command, made of the fields of a dataclass: nothing is declared twice."""

from __future__ import annotations

import functools
import sys
import types
from collections.abc import Callable, Collection
from dataclasses import MISSING, Field, fields
from pathlib import Path
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

import click

from documents.options import Typed, described
from runner.cli.number_types import Whole, Within

Command = Callable[..., Any]
_MOST, _MOST_WHOLE, _MOST_SEED = 1e12, 10**9, 10**40


def takes(kind: type, name: str = "options", *, leave_out: Collection[str] = ()) -> Callable[[Command], Command]:
    """Return what gives a command an option for each field of ``kind``, and one ``kind`` called ``name`` made of them.

    Parameters
    ----------
    kind
        A dataclass, whose docstring says what each field is.
    name
        What the command calls it.
    leave_out
        Fields that are no options: the command fills them.
    """
    mine = [field for field in fields(kind) if field.name not in leave_out]

    def add(command: Command) -> Command:
        @functools.wraps(command)
        def called(**given: Any) -> Any:
            made = kind(**{field.name: given.pop(field.name) for field in mine})
            return command(**given, **{name: made})

        with_options: Command = called
        for field in reversed(mine):
            with_options = _option(kind, field)(with_options)
        return with_options

    return add


def _option(kind: type, field: Field[Any]) -> Callable[[Command], Command]:
    """Return the option of a field."""
    typed, of, optional = _type_of(kind, field)
    required = field.default is MISSING and field.default_factory is MISSING
    default = None if required else field.default if field.default_factory is MISSING else field.default_factory()
    flag = typed.flag or f"--{field.name.replace('_', '-')}"
    how: dict[str, Any] = {"default": default, "required": required, "help": described(kind)[field.name]}
    if typed.metavar:
        how["metavar"] = typed.metavar
    if of is bool:
        how["is_flag"] = True
        if "/" not in flag and (optional or default):
            flag = f"{flag}/--no-{flag.removeprefix('--')}"
    else:
        how |= _value(typed, of)
        how["show_default"] = default not in (None, (), "")
    return click.option(flag, field.name, **how)


def _value(typed: Typed, of: Any) -> dict[str, Any]:
    """Return how click reads a value of a type."""
    if get_origin(of) is Literal:
        return {"type": click.Choice(get_args(of))}
    if get_origin(of) is tuple:
        inner, *_ = get_args(of)
        if get_origin(inner) is tuple:
            return {"multiple": True, "nargs": len(get_args(inner)), **_value(typed, get_args(inner)[0])}
        return {"multiple": True, **_value(typed, inner)}
    if of is int:
        return {"type": Whole(int(max(typed.least, -_MOST_WHOLE)), int(min(typed.most, _MOST_WHOLE)))}
    if of is float:
        return {"type": Within(max(typed.least, -_MOST), min(typed.most, _MOST), min_open=typed.above)}
    return {"type": click.Path(path_type=Path)} if of is Path else {}


def _type_of(kind: type, field: Field[Any]) -> tuple[Typed, Any, bool]:
    """Return what a field's annotation says of how it is typed, its type without None, and whether None is one."""
    alone = types.SimpleNamespace(__annotations__={field.name: field.type})  # others may name what is not imported
    of: Any = get_type_hints(alone, vars(sys.modules[kind.__module__]), include_extras=True)[field.name]
    typed = Typed()
    if get_origin(of) is Annotated:
        of, *marks = get_args(of)
        typed = next((mark for mark in marks if isinstance(mark, Typed)), typed)
    optional = False
    if get_origin(of) in (Union, types.UnionType):
        optional = type(None) in get_args(of)
        kinds = [each for each in get_args(of) if each is not type(None)]
        of = Path if Path in kinds else kinds[0]
    return typed, of, optional
