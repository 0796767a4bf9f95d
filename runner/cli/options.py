"""The options of a command, made of the fields of a dataclass: nothing is declared twice. And types of numbers.

Each number has a range, and none takes NaN, infinity or what nobody means.
"""

from __future__ import annotations

import functools
import importlib
import math
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import MISSING, Field, fields, is_dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

import click

from documents.options import Typed, described, read_text, type_of

Command = Callable[..., Any]
# Beyond what anything measures: said to whoever passes it, and left out of the help.
_MOST, _MOST_WHOLE, _MOST_SEED = 1e12, 10**9, 10**40
PATH: click.Path = click.Path(path_type=Path)


class Within(click.FloatRange):
    """A number between limits."""

    name = "float"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Return the number; fails for what is none, and beyond the limits."""
        number = float(click.FLOAT.convert(value, param, ctx))
        if not math.isfinite(number) or abs(number) > _MOST:
            self.fail(f"{value!r} is no number of at most {_MOST:g}.", param, ctx)
        return super().convert(number, param, ctx)

    def _describe_range(self) -> str:
        return _near(self, super()._describe_range())


class Whole(click.IntRange):
    """A whole number between limits."""

    name = "integer"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """Return the number; fails for what is none, and beyond the limits."""
        number = int(click.INT.convert(value, param, ctx))
        if self.max is not None and number > self.max >= _MOST_WHOLE:
            self.fail(f"a number of at most {self.max:g} is wanted.", param, ctx)
        return super().convert(number, param, ctx)

    def _describe_range(self) -> str:
        return _near(self, super()._describe_range())


def _near(kind: Within | Whole, described: str) -> str:
    """Return click's words on a range without limits that are far."""
    low, high = kind.min, kind.max
    if low is not None and abs(low) >= _MOST_WHOLE:
        return ""
    if high is not None and high >= _MOST_WHOLE:
        return f"x{'>' if kind.min_open else '>='}{low}"
    return described


NUMBER = Within(-_MOST, _MOST)
NOT_NEGATIVE = Within(0, _MOST)
POSITIVE = Within(0, _MOST, min_open=True)
COUNT = Whole(0, _MOST_WHOLE)
NATURAL = Whole(1, _MOST_WHOLE)
SEED = Whole(0, _MOST_SEED)


def several(text: str, between: str) -> tuple[float, ...]:
    """Return the numbers in ``text`` with ``between`` them; ValueError if one is none that anybody means."""
    numbers = tuple(float(part) for part in text.split(between))
    if not all(abs(number) <= _MOST for number in numbers):  # nor NaN
        raise ValueError(text)
    return numbers


def _reader(one: Within | Whole, count: int, typed: Typed) -> Callable[[Any], tuple[float, ...]]:
    """Return what reads so many numbers in one word, each of ``one`` type; it raises BadParameter for any other."""

    def numbers(text: str | tuple[float, ...]) -> tuple[float, ...]:
        if isinstance(text, tuple):
            return text  # the default
        parts = (text.lower().replace("×", "x") if typed.between == "x" else text).split(typed.between)
        try:
            if len(parts) != count:
                raise ValueError(text)
            return tuple(one.convert(part, None, None) for part in parts)
        except (ValueError, click.BadParameter):
            what = "whole numbers" if isinstance(one, Whole) else "numbers"
            shape = (typed.metavar or typed.between.join("ABCD"[:count])).split()[0]
            raise click.BadParameter(f"it is '{text}'; write {count} {what} as {shape}") from None

    return numbers


def takes(kind: type | str, name: str = "options", *, leave_out: Collection[str] = ()) -> Callable[[Command], Command]:
    """Return what gives a command an option for each field of ``kind``, and one ``kind`` called ``name`` made of them.

    A field that is such a dataclass itself stands for its fields.

    Parameters
    ----------
    kind
        A dataclass, whose docstring says what each field is; or its full name, for one that is imported when the
        command is asked for: beside commands that do not take it.
    name
        What the command calls it.
    leave_out
        Fields that are no options: the command fills them.
    """

    def add(command: Command) -> Command:
        @functools.wraps(command)
        def called(**given: Any) -> Any:
            made = _made(_dataclass(kind), given, leave_out)
            return command(**given, **{name: made})

        later = partial(_options, kind, leave_out)
        params = [later] if isinstance(kind, str) else reversed(later())
        vars(called)["__click_params__"] = [*getattr(command, "__click_params__", ()), *params]
        return called

    return add


def _dataclass(kind: type | str) -> type:
    if isinstance(kind, type):
        return kind
    module, _, name = kind.rpartition(".")
    found: type = getattr(importlib.import_module(module), name)
    return found


def _options(kind: type | str, leave_out: Collection[str]) -> list[click.Option]:
    return [_option(of, field) for of, field in _fields(_dataclass(kind), leave_out)]


def completed(command: click.Command) -> click.Command:
    """Return a command with all its options, also those of dataclasses that it `takes` by their names."""
    parts: list[Any] = [part() if isinstance(part, partial) else (part,) for part in command.params]
    command.params = [one for part in parts for one in part]
    return command


def _fields(kind: type, leave_out: Collection[str]) -> Iterator[tuple[type, Field[Any]]]:
    """Yield the fields that are options, each with the dataclass that it is one of."""
    for field in fields(kind):
        if field.name not in leave_out:
            _, of, _ = type_of(kind, field)
            yield from _fields(of, leave_out) if _is_options(of) else ((kind, field),)


def _is_options(of: Any) -> bool:
    return is_dataclass(of)


def _made(kind: type, given: dict[str, Any], leave_out: Collection[str]) -> Any:
    """Return a ``kind`` made of what was typed, which is taken out of ``given``."""
    values = {}
    for field in fields(kind):
        if field.name not in leave_out:
            typed, of, _ = type_of(kind, field)
            if _is_options(of):
                values[field.name] = _made(of, given, leave_out)
            elif not typed.read:
                value = given.pop(field.name)
                values[field.name] = None if value == () and field.default is None else value
            elif (value := given.pop(field.name)) not in (None, ()):
                with _naming(_flags(typed, field)[0]):
                    read = partial(read_text, typed.read)
                    values[field.name] = tuple(map(read, value)) if isinstance(value, tuple) else read(value)
                    if get_origin(of) is Mapping:  # of each text a key and a value
                        values[field.name] = dict(values[field.name])
    return kind(**values)


@contextmanager
def _naming(flag: str) -> Iterator[None]:
    """Name the option whose text a ValueError is about."""
    try:
        yield
    except ValueError as error:
        raise click.BadParameter(str(error), param_hint=f"'{flag}'") from None


def _flags(typed: Typed, field: Field[Any]) -> list[str]:
    return typed.flag.split() or [f"--{field.name.replace('_', '-')}"]


def _option(kind: type, field: Field[Any]) -> click.Option:
    """Return the option of a field."""
    typed, of, optional = type_of(kind, field)
    required = field.default is MISSING and field.default_factory is MISSING
    default = None
    if not required and not typed.read:
        default = field.default if field.default_factory is MISSING else field.default_factory()
    flags = _flags(typed, field)
    how: dict[str, Any] = {"default": default, "required": required, "help": described(kind)[field.name]}
    if typed.metavar:
        how["metavar"] = typed.metavar
    if typed.value is not None:
        how["flag_value"] = typed.value
    elif of is bool:
        how["is_flag"] = True
        if "/" not in flags[0] and (optional or default):
            flags = [f"{flags[0]}/--no-{flags[0].removeprefix('--')}"]
    else:
        how |= _value(typed, of)
        how["show_default"] = default not in (None, (), "") and "Default:" not in how["help"]
    return click.Option([*flags, field.name], **how)


def _value(typed: Typed, of: Any) -> dict[str, Any]:
    """Return how click reads a value of a type."""
    parts = get_args(of)
    if get_origin(of) is Literal:
        return {"type": click.Choice([str(part) for part in parts])}
    if get_origin(of) is tuple:
        one = _value(typed, parts[0])
        if parts[1:] == (...,):
            return {"multiple": True, **one}
        if isinstance(one.get("type"), Within | Whole):
            return {"type": _reader(one["type"], len(parts), typed)}
        return {"nargs": len(parts), **one}
    if get_origin(of) is Mapping:
        return {"multiple": True}
    if of is int:
        most = _MOST_WHOLE if math.isinf(typed.most) else min(typed.most, _MOST_SEED)
        return {"type": Whole(int(max(typed.least, -_MOST_WHOLE)), int(most))}
    if of is float:
        return {"type": Within(max(typed.least, -_MOST), min(typed.most, _MOST), min_open=typed.above)}
    return {"type": PATH} if of is Path else {}


def _limit_threads(context: click.Context, _: click.Parameter, number: int | None) -> None:
    from documents.threads import at_most_threads

    context.with_resource(at_most_threads(number))


threads = click.option(
    "--threads",
    type=click.IntRange(1, 256),
    metavar="N",
    expose_value=False,
    callback=_limit_threads,
    help="Number of threads to compute with. Default: one for each processor core. Results do not depend on it.",
)
