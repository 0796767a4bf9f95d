"""What a dataset says of itself, in Python and typed: here, so that help appears before numpy is there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated

from documents.options import Typed


@dataclass(frozen=True, slots=True)
class About:
    """What a dataset says of itself, and whose sessions are in it.

    Attributes
    ----------
    name
        Name of the dataset. Default: the experiments' names.
    authors
        Author of the dataset; repeat for each.
    license
        Licence of the dataset, such as CC0 or CC-BY-4.0.
    with_simulated
        Export simulated observers beside people; without it they are exported only where nobody else answered.
    facts
        What a paper must say of each experiment and no log can, by the code of the item.
    """

    name: str | None = None
    authors: Annotated[tuple[str, ...], Typed("--author")] = ()
    license: str | None = None
    with_simulated: bool = False
    facts: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
