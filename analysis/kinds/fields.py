"""What the fields of records are made of, and how a value that does not fit is reported."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Collection, Mapping
from datetime import datetime
from typing import Annotated, Any, ClassVar, Literal, TypeVar, get_args

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, Strict, ValidationError

SCHEMA_VERSION: Literal[1] = 1  # of a session's log
_LONGEST = 1e9  # s: longer than anybody sits
_MOST = 2**53
_DEEPEST = 24
_SHOWN = 60
_HALF = re.compile("[\ud800-\udfff]")
_UTC = re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d(\.\d{1,6})?(Z|\+00:00)", re.ASCII)


class RecordError(ValueError):
    """A record is not what it should be; as text, what is wrong. ``remedy`` is what to do if it is no damage."""

    def __init__(self, what: str, remedy: str | None = None) -> None:
        super().__init__(what)
        self.remedy = remedy


class HalfCharacterError(RecordError):
    """A text has half of a surrogate pair, as a keyboard may give it."""


_MOST_BITS = 200  # a seed of forty digits has 133


def plain(value: Any, depth: int = 0) -> Any:
    """Return ``value`` if it can be written again as JSON: finite, of whole characters, not nested too deeply."""
    if isinstance(value, str):
        if not value.isascii() and _HALF.search(value):
            raise HalfCharacterError("half a character is no text")
    elif isinstance(value, int):
        if value.bit_length() > _MOST_BITS:
            raise ValueError("a whole number has too many digits")
    elif isinstance(value, float):
        if not math.isfinite(value):
            raise ValueError("a number must be finite")
    elif isinstance(value, Mapping | list):
        if depth == _DEEPEST:
            raise ValueError("it is nested too deeply")
        if isinstance(value, Mapping):
            for key in value:
                plain(key)
        for inner in value.values() if isinstance(value, Mapping) else value:
            plain(inner, depth + 1)
    return value


def _utc(text: str) -> str:
    if _UTC.fullmatch(text) is None:
        raise ValueError("should be a time in UTC such as 2026-01-31T12:00:00.250+00:00")
    datetime.fromisoformat(text)
    return text


Text = Annotated[str, Field(max_length=100_000)]
Name = Annotated[str, Field(min_length=1, max_length=100_000)]
Count = Annotated[int, Field(ge=0, le=_MOST)]
Whole = Annotated[int, Field(ge=-_MOST, le=_MOST)]
Seconds = Annotated[float, Field(ge=0, le=_LONGEST)]
Positive = Annotated[float, Field(gt=0, le=1e12)]
NotNegative = Annotated[float, Field(ge=0, le=1e12)]
Number = Annotated[float, Field(ge=-1e12, le=1e12)]
# Levels of factors, such as a date and time in digits; what has room for 24 typed digits; what a session counted.
Level = Annotated[float, Field(ge=-1e18, le=1e18)]
WholeLevel = Annotated[int, Field(ge=-(10**18), le=10**18)]
Typed = Annotated[float, Field(ge=-1e24, le=1e24)]
TypedWhole = Annotated[int, Field(ge=-(10**24), le=10**24)]
Work = Annotated[float, Field(ge=0, le=1e18)]
Percent = Annotated[float, Field(ge=0, le=100)]
Utc = Annotated[str, AfterValidator(_utc)]
Json = Annotated[dict[str, Any], AfterValidator(plain)]
# A pair in JSON is a list; strictly taken, it would be no tuple.
Event = Annotated[tuple[Name, Seconds], Strict(False)]
XYZ = Annotated[tuple[Number, Number, Number], Strict(False)]


class Fields(BaseModel):
    """Fields of a record, of exactly their types; further ones are allowed, since a newer version may add some."""

    model_config = ConfigDict(strict=True, extra="allow", allow_inf_nan=False, defer_build=True)

    nested: ClassVar[tuple[str, ...]] = ()
    """The names of those that are, or have in them, fields of their own."""

    def given(self) -> dict[str, Any]:
        """Return what was given as plain values of JSON, in the order of the fields."""
        return self.model_dump(mode="json", by_alias=True, exclude_unset=True, warnings=False)

    def to_json(self) -> dict[str, Any]:
        """Return what a line has, in the fields' order, without what ``exclude_if`` says; within, what was given."""
        held, known = self.given(), type(self).model_fields.items()
        values = {name: (field, getattr(self, name)) for name, field in known}
        left_out = {name for name, (field, value) in values.items() if field.exclude_if and field.exclude_if(value)}
        own = {name: held.pop(name, _plain(value)) for name, (_, value) in values.items() if name not in left_out}
        return own | held

    @classmethod
    def __pydantic_init_subclass__(cls, **more: Any) -> None:
        super().__pydantic_init_subclass__(**more)
        cls.nested = tuple(name for name, known in cls.model_fields.items() if _has_fields(known.annotation))


def _plain(value: Any) -> Any:
    return value.given() if isinstance(value, Fields) else value


def _has_fields(annotation: Any) -> bool:
    if isinstance(annotation, type):
        return issubclass(annotation, Fields)
    return any(_has_fields(inner) for inner in get_args(annotation))


Model = TypeVar("Model", bound=Fields)


def read_fields(model: type[Model], value: Any, checked: Collection[str] = ()) -> Model:
    """Return ``value`` as a ``model``; fields that are ``checked`` were read as what they are before.

    Raises
    ------
    HalfCharacterError
        If a text has half of a surrogate pair.
    RecordError
        If a field is missing or wrong, or a further one is a missing one but for a letter.
    """
    try:
        fields: Model = model.__pydantic_validator__.validate_python(value)
    except ValidationError as error:
        if any(fault["type"] == "string_unicode" for fault in error.errors(include_url=False)):
            raise HalfCharacterError("half a character is no text") from None
        raise RecordError(_words(error)) from None
    _check_further(fields, checked)
    return fields


def _check_further(fields: Fields, checked: Collection[str] = ()) -> None:
    """Raise RecordError for further fields that look like a known one, or that no JSON can hold."""
    more = fields.__pydantic_extra__
    if more:
        missing = type(fields).model_fields.keys() - fields.model_fields_set
        for key, unknown in more.items():
            for name in missing:
                if len(name) == len(key) and sum(a != b for a, b in zip(name, key, strict=True)) == 1:
                    raise RecordError(f"'{key}' is no field, and '{name}', a letter away, is missing")
            try:
                plain({key: unknown})
            except RecordError:
                raise
            except ValueError as error:
                raise RecordError(f"'{key}' cannot be: {error}") from None
    if fields.__pydantic_fields_set__.isdisjoint(fields.nested):
        return
    for name in fields.nested:
        value = getattr(fields, name)
        if value is None or name in checked:
            continue
        inside = value.values() if isinstance(value, dict) else value if isinstance(value, list | tuple) else (value,)
        for inner in inside:
            if isinstance(inner, Fields):
                _check_further(inner)


def of_whole_characters(value: Any) -> Any:
    """Return a value of JSON with U+FFFD for each half of a surrogate pair."""
    if isinstance(value, str):
        return _HALF.sub("\N{REPLACEMENT CHARACTER}", value)
    if isinstance(value, dict):
        return {of_whole_characters(key): of_whole_characters(inner) for key, inner in value.items()}
    return [of_whole_characters(inner) for inner in value] if isinstance(value, list) else value


def _words(error: ValidationError) -> str:
    """Return the first fault in words: which field, what it is, what it should be."""
    first = error.errors(include_url=False, include_context=False)[0]
    place = ".".join(str(part) for part in first["loc"])
    if first["type"] == "missing":
        return f"'{place}' is missing"
    message = first["msg"].removeprefix("Value error, ").replace("valid tuple", "valid list")
    message = message[message.index("should") :] if "should" in message else message
    return f"'{place}' is {shown(first['input'])}: it {message}" if place else f"it {message}"


def shown(value: Any) -> str:
    """Return a value as JSON, cut where it is long."""
    try:
        text = json.dumps(value, default=str, ensure_ascii=False)
    except (RecursionError, ValueError):
        return "something that is nested too deeply"
    return text if len(text) <= _SHOWN else f"{text[:_SHOWN]}…"
