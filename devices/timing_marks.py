"""The rig file's ``timing_marks``: where marks of onsets and answers go, of kinds that are found by name."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Annotated, Any, ClassVar, TypeAlias

from pydantic import Discriminator, Field, Tag

from documents.extensions import Registry, of_base
from documents.yaml import ByKind, FileModel


class MarksKind(FileModel):
    """Base of every kind of entry: its fields are the keys that people write.

    ``place`` is the key that says where marks go. ``part`` names, as ``module:class``, the part of a rig that opens
    such entries and sends the marks (`runner.session.rig_part.RigPart`).
    """

    place: ClassVar[str] = "port"
    part: ClassVar[str]
    kind: str

    @property
    def name(self) -> str:
        """What it is called in records and messages, such as ``serial /dev/ttyUSB0``."""
        return f"{self.kind} {getattr(self, self.place)}"


MARKS: Registry[type[MarksKind]] = Registry("cyclopean.marks", {}, of_base(MarksKind))
_Entry: TypeAlias = Annotated[MarksKind, ByKind(MARKS)]


def _shape(value: Any) -> str:
    return "several" if isinstance(value, list | tuple) else "one"


TimingMarksSpec: TypeAlias = Annotated[
    Annotated[_Entry, Tag("one")] | Annotated[list[_Entry], Tag("several"), Field(min_length=1)], Discriminator(_shape)
]


def listed_twice(marks: Sequence[MarksKind]) -> Iterator[int]:
    """Yield which of ``marks``, counted from 0, go where one before them goes."""
    names = [spec.name for spec in marks]
    yield from (index for index, name in enumerate(names) if name in names[:index])


def listed_marks(spec: TimingMarksSpec | None) -> tuple[MarksKind, ...]:
    """Return a rig's ``timing_marks`` as a tuple, whether they are one mapping or a list; empty if there are none."""
    if spec is None:
        return ()
    return tuple(spec) if isinstance(spec, list) else (spec,)
