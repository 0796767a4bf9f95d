"""Commands made of functions, and options of the fields of a dataclass: nothing is declared twice. Types of numbers.

Each number has a range, and none takes NaN, infinity or what nobody means.
"""

from __future__ import annotations

import functools
import importlib
import inspect
import math
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import MISSING, Field, fields, is_dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal, Union, get_args, get_origin

import click

from documents.options import Typed, described, parameters_of, read_text, type_of
from documents.text import json_value
from runner.cli.output import HANDS, gives

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


class _Open(click.Choice[str]):
    """A name of ours, or another: what is done with it knows whether another package has it."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the name."""
        return value


def _near(kind: Within | Whole, described: str) -> str:
    """Return click's words on a range without limits that are far."""
    low, high = kind.min, kind.max
    if low is not None and abs(low) >= _MOST_WHOLE:
        return ""
    if high is not None and high >= _MOST_WHOLE:
        return f"x{'>' if kind.min_open else '>='}{low}"
    return described


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


def takes(kind: str, *, leave_out: Collection[str] = ()) -> Callable[[Command], Command]:
    """Return what gives a command an option for each field of ``kind``, and in ``options`` one ``kind`` made of them.

    A field that is such a dataclass itself stands for its fields.

    Parameters
    ----------
    kind
        Full name of a dataclass, whose docstring says what each field is. It is imported when the command is asked for.
    leave_out
        Fields that are no options: the command fills them.
    """

    def add(command: Command) -> Command:
        @functools.wraps(command)
        def called(**given: Any) -> Any:
            return command(options=_made(_named(kind), given, leave_out), **given)

        vars(called)["__click_params__"] = [
            *getattr(command, "__click_params__", ()),
            partial(_options, kind, leave_out),
        ]
        return called

    return add


def command_of(
    function: str,
    *more: Command,
    leave_out: Collection[str] = (),
    lines: Callable[[Any], Iterable[str]] | None = None,
    **printed: Any,
) -> click.Command:
    """Return the command that a function is: its parameters are arguments and options, its docstring is the help.

    A parameter ``options`` stands for the fields of its dataclass. What is in `runner.cli.output.HANDS`, such as
    ``progress``, the command line hands it by itself. Of the docstring the help is what stands before the parameters.

    Parameters
    ----------
    function
        Its full name; it is imported when the command runs.
    more
        Decorators of further options.
    leave_out
        Parameters, and fields of the options, that are not typed.
    lines
        What people read of the result, where it does not say that by itself.
    printed
        How the result is printed, as for `runner.cli.output.gives`.
    """
    kind = parameters_of(function)
    typed = [field for field in fields(kind) if field.name not in {*HANDS, *leave_out}]

    def command(**given: Any) -> Any:
        values = {}
        for field in typed:
            if field.name == "options":
                values["options"] = _made(_named(kind.taken), given, leave_out)
            elif (value := _value_of(kind, field, given)) is not MISSING:
                values[field.name] = value
        several = values.pop(kind.several, ())
        found = _named(function)(*several, **values, **given)
        return (json_value(found), lines(found)) if lines else found

    names = [each.name for each in fields(kind) if each.name in HANDS]
    handed = [inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY) for name in names]
    vars(command)["__signature__"] = inspect.Signature(handed)
    params: list[click.Parameter] = []
    for field in typed:
        params += _options(kind.taken, leave_out) if field.name == "options" else [_parameter(kind, field)]
    printing = gives(**printed)(command)
    for each in more:
        printing = each(printing)
    vars(printing)["__click_params__"] += params[::-1]
    return click.command(help=re.split(r"\n\n\w+\n---", inspect.cleandoc(kind.__doc__ or ""))[0])(printing)


def _named(name: str) -> Any:
    module, _, name = name.rpartition(".")
    return getattr(importlib.import_module(module), name)


def _options(kind: str, leave_out: Collection[str]) -> list[click.Parameter]:
    return [_parameter(of, field) for of, field in _fields(_named(kind), leave_out)]


def completed(command: click.Command) -> click.Command:
    """Return a command with all its options, also those of dataclasses that it `takes` by their names."""
    parts: list[Any] = [part() if isinstance(part, partial) else (part,) for part in command.params]
    command.params = [one for part in parts for one in part]
    return command


def _fields(kind: Any, leave_out: Collection[str]) -> Iterator[tuple[type, Field[Any]]]:
    """Yield the fields that are options, each with the dataclass that it is one of."""
    for field in fields(kind):
        if field.name not in leave_out:
            _, of, _ = type_of(kind, field)
            yield from _fields(of, leave_out) if is_dataclass(of) else ((kind, field),)


def _made(kind: Any, given: dict[str, Any], leave_out: Collection[str]) -> Any:
    """Return a ``kind`` made of what was typed, which is taken out of ``given``."""
    values = {}
    for field in fields(kind):
        if field.name not in leave_out:
            _, of, _ = type_of(kind, field)
            made = _made(of, given, leave_out) if is_dataclass(of) else _value_of(kind, field, given)
            if made is not MISSING:
                values[field.name] = made
    return kind(**values)


def _value_of(kind: type, field: Field[Any], given: dict[str, Any]) -> Any:
    """Return what was typed for a field, taken out of ``given``; MISSING where that would have been read."""
    typed, of, _ = type_of(kind, field)
    value = given.pop(field.name)
    if not typed.read:
        return None if value == () and field.default is None else value
    if value in (None, ()):
        return MISSING
    with _naming(_flags(typed, field)[0]):
        read = partial(read_text, typed.read)
        found = tuple(map(read, value)) if isinstance(value, tuple) else read(value)
        return dict(found) if get_origin(of) is Mapping else found  # of each text a key and a value


@contextmanager
def _naming(flag: str) -> Iterator[None]:
    """Name the option whose text a ValueError is about."""
    try:
        yield
    except ValueError as error:
        raise click.BadParameter(str(error), param_hint=f"'{flag}'") from None


def _flags(typed: Typed, field: Field[Any]) -> list[str]:
    return typed.flag.split() or [f"--{field.name.replace('_', '-')}"]


def _parameter(kind: type, field: Field[Any]) -> click.Parameter:
    """Return the option of a field, or the argument of one without a flag that has no default."""
    typed, of, optional = type_of(kind, field)
    required = field.default is MISSING and field.default_factory is MISSING
    default = None
    if typed.place or (kind.__module__ == parameters_of.__module__ and required and not typed.flag):
        return _argument(kind, typed, of, field)
    if not required and not typed.read:
        default = field.default if field.default_factory is MISSING else field.default_factory()
    flags = _flags(typed, field)
    how: dict[str, Any] = {"required": True} if required else {"default": default}
    how["help"] = described(kind)[field.name]
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


def _argument(kind: Any, typed: Typed, of: Any, field: Field[Any]) -> click.Argument:
    how: dict[str, Any] = {"metavar": typed.metavar}
    how |= {"required": True} if field.default is MISSING else {"required": False, "default": field.default}
    if get_origin(of) is Sequence or field.name == kind.several:
        how["nargs"], of = -1, Path if "Path" in str(field.type) else str
    return click.Argument([field.name], **how, **_value(typed, of))


def _value(typed: Typed, of: Any) -> dict[str, Any]:
    """Return how click reads a value of a type."""
    parts = get_args(of)
    if get_origin(of) is Union:
        return {"type": _Open(get_args(parts[0]))}
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
    return {"type": PATH} if of is Path and not typed.read else {}


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
