"""The promises of every way to score comparisons, tried on one: each item has its row, in any order of the answers."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from typing import Any

from analysis.comparisons import Answer, from_answers
from cyclopean.testing.promises import kept
from documents.options import option_names
from documents.pages import Section, sections_html
from runner.reports import METHODS, Scored, ScoresOptions, score_table

# Of six answers to a pair by each of four observers, how many prefer the better item.
_PREFERRED = (2, 4, 6, 5)


def prove_method(name: str, *, method: type[Scored] | None = None) -> tuple[str, ...]:
    """Prove that a way to score comparisons keeps what the program promises of every one.

    Four observers compare four items, of which the first is the best; then so within two groups.

    Parameters
    ----------
    name
        What is typed after ``--method``, or behind the point what is typed after ``--observers``.
    method
        The class, where its package is not installed.

    Returns
    -------
    tuple of str
        The promises that it kept.

    Raises
    ------
    BrokenPromiseError
        If a promise is not kept.
    InputError
        If nobody offers it, or it refuses the answers.

    Examples
    --------
    >>> "each item has a row, the best one first" in prove_method("map")
    True
    """
    with METHODS.trying(name, method):
        tried = _Tried(name)
        return kept(
            {
                "what it refuses are options": tried.refused,
                "each item has a row, the best one first": tried.items,
                "the order of the answers changes nothing": tried.any_order,
                "each group has rows of its own": tried.groups,
                "it is told as it is in JSON": tried.told,
            }
        )


class _Tried:
    """Answers, and their scores; each attempt returns what broke."""

    def __init__(self, name: str) -> None:
        option, _, value = name.rpartition(".")
        self._options = ScoresOptions(**{option or "method": value})  # type: ignore[arg-type]  # a text
        self._kind = METHODS.wanted(name, "method")
        self._answers = [
            Answer(*pair, float(count), f"observer {observer}")
            for observer, preferred in enumerate(_PREFERRED)
            for one, other in combinations("abcd", 2)
            for pair, count in (((one, other), preferred), ((other, one), 6 - preferred))
        ]

    def _scored(self, answers: Sequence[Answer]) -> Scored:
        return score_table(from_answers(answers, items="abcd"), self._options)

    def refused(self) -> str | None:
        unknown = sorted(set(self._kind.refused) - set(option_names(ScoresOptions)))
        return f"there is no option '{unknown[0]}'" if unknown else None

    def items(self) -> str | None:
        scored = self._scored(self._answers)
        names = "".join(row["name"] for row in scored.rows())
        return None if scored.title and names == "abcd" and not scored.problems else f"they are {names}"

    def any_order(self) -> str | None:
        rows, others = (self._scored(answers).rows() for answers in (self._answers, self._answers[::-1]))
        return None if len(rows) == len(others) and all(map(_alike, rows, others)) else "the rows are others"

    def groups(self) -> str | None:
        scored = self._scored([replace(one, group=name) for name in ("x", "y") for one in self._answers])
        names = [row.get("group") for row in scored.rows() if row.get("group")]
        return None if names == ["x"] * 4 + ["y"] * 4 else f"their groups are {names}"

    def told(self) -> str | None:
        scored = self._scored(self._answers)
        json.dumps(scored.to_json(), allow_nan=False)
        page = sections_html([Section("result", scored.title, tuple(scored.told()))])
        lacking = [row["name"] for row in scored.rows() if f">{row['name']}<" not in page]
        return f"'{lacking[0]}' is not there" if lacking else None


def _alike(row: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    """Say whether two rows are the same but for rounding."""
    return row.keys() == other.keys() and all(
        abs(value - other[key]) <= 1e-6 * (1 + abs(value)) if isinstance(value, float) else value == other[key]
        for key, value in row.items()
    )
