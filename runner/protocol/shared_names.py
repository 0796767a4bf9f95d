"""Names by which results put the answers of several blocks together: one name must mean the same wherever it stands."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from documents import Finding
from documents.yaml import YamlSource
from runner.blocks.block import BlockKind, Named
from runner.blocks.setting import Stimuli


def name_clashes(specs: Sequence[BlockKind], stimuli: Stimuli, source: YamlSource) -> Iterator[Finding]:
    """Yield each name of a series or a scale that means something else where it stands first.

    Blocks of one kind may share a name that means the same, as where a block is repeated later in the session.
    """
    first: dict[tuple[str, str, str], tuple[int, Named]] = {}
    taken = {(spec.kind, named.what, named.name) for spec in specs for named in spec.named(stimuli)}
    for index, spec in enumerate(specs):
        for named in spec.named(stimuli):
            key = spec.kind, named.what, named.name
            before, other = first.setdefault(key, (index, named))
            if other.meaning == named.meaning:
                continue
            place = source.place(("blocks", before, *other.path), key=True)
            where = f"block {before + 1}" + (f" (line {place.line})" if place else "")
            what = f"the {named.what} '{named.name}' means {named.words} here and {other.words} in {where}"
            if before == index:
                what = f"two of the {named.what} that the factors make are called '{named.name}': "
                what += f"{other.words}; {named.words}"
            remedy = _remedy(named, key, taken, in_one_block=before == index)
            yield source.finding(("blocks", index, *named.path), f"{what}; results would mix them", remedy, key=True)


def _remedy(named: Named, key: tuple[str, str, str], taken: set[tuple[str, str, str]], *, in_one_block: bool) -> str:
    if named.path[-1] == "by":
        return "list the series by name" + (" in one of the blocks" if not in_one_block else "")
    number = 2
    while (*key[:2], f"{named.name}_{number}") in taken:
        number += 1
    return f"give it a name of its own, such as '{named.name}_{number}'"
