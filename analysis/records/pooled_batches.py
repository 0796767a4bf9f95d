"""Batches of pairs that were chosen by the answers of all observers: the record of what was known, and the pairs.

A block of `active_pairs` with ``pool: results`` chooses each batch by what the other sessions in the results folder
have answered by then (`runner.session.pooling`). A line of the log (``"record": "pool"``), before the batch's first
trial, keeps that, so that the session can be resumed and replayed from its log alone.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

from pydantic import Field, Strict

from analysis.kinds.fields import Count, Fields, Name, NotNegative, Number, RecordError, Utc, read_fields
from analysis.kinds.trial import Trial

Wins = dict[tuple[str, str], float]
_CLOSE = 1e-6


_Change = Annotated[tuple[Count, Count, Number], Strict(False)]
_Pair = Annotated[tuple[Count, Count], Strict(False)]


class PooledBatch(Fields):
    """What was known of the other sessions when a batch of pairs was chosen, and the pairs.

    Attributes
    ----------
    block, trial
        The place of the batch's first trial.
    stimuli
        Names of the block's stimuli, to which the numbers in the other fields refer.
    sessions
        How many answers of each other session were known, by ``OBSERVER/SESSION``.
    changes
        (winner, loser, wins): by how much the number of wins differs from that in the block's batch before. A tie is
        half a win for each.
    wins_sha256
        Of all wins known, `wins_digest`.
    mean_nats, sd_nats
        Of each stimulus: mean and standard deviation of the posterior of its strength, by these answers and those of
        this session so far.
    pairs
        (first, second) of each trial of the batch.
    utc
        When it was chosen.
    """

    record: Literal["pool"] = "pool"
    block: Count
    trial: Count
    stimuli: Annotated[tuple[Name, ...], Strict(False), Field(min_length=2)]
    sessions: dict[Name, Count]
    changes: Annotated[tuple[_Change, ...], Strict(False)]
    wins_sha256: Name
    mean_nats: Annotated[tuple[Number, ...], Strict(False)]
    sd_nats: Annotated[tuple[NotNegative, ...], Strict(False)]
    pairs: Annotated[tuple[_Pair, ...], Strict(False), Field(min_length=1)]
    utc: Utc = ""

    @property
    def place(self) -> tuple[int, int]:
        """Block and trial."""
        return self.block, self.trial


def wins_digest(wins: Mapping[tuple[str, str], float]) -> str:
    """Return the SHA-256 of numbers of wins by (winner, loser): of the JSON list of [winner, loser, wins], sorted."""
    listed = sorted([winner, loser, float(won)] for (winner, loser), won in wins.items() if won)
    return hashlib.sha256(json.dumps(listed, ensure_ascii=True, separators=(",", ":")).encode()).hexdigest()


@dataclass(slots=True)
class PooledBatches:
    """The batches of a log so far: what each says must agree with those before it, and its trials with its pairs."""

    _wins: dict[int, Wins] = field(default_factory=dict)
    _last: dict[int, PooledBatch] = field(default_factory=dict)

    @property
    def are_any(self) -> bool:
        """Whether there was one."""
        return bool(self._last)

    def take(self, line: Mapping[str, Any], *, changed: bool) -> PooledBatch:
        """Take the next batch; after a change of the experiment that was accepted, it need not follow the one before.

        Raises
        ------
        RecordError
            If it does not say what it can say.
        """
        batch = read_fields(PooledBatch, line)
        if not batch.utc:
            raise RecordError("'utc' is missing")
        before = self._last.get(batch.block)
        due = before.trial + len(before.pairs) if before else 0
        if batch.trial != due and not changed:
            raise RecordError(f"the next batch of block {batch.block} begins at trial {due}, not at {batch.trial}")
        if len(set(batch.stimuli)) < len(batch.stimuli):
            raise RecordError("a stimulus stands twice in 'stimuli'")
        for numbers in (batch.mean_nats, batch.sd_nats):
            if len(numbers) != len(batch.stimuli):
                raise RecordError("'mean_nats' and 'sd_nats' have one number for each stimulus")
        _check_pairs([change[:2] for change in batch.changes], len(batch.stimuli))
        _check_pairs(batch.pairs, len(batch.stimuli))
        wins = after_changes(self._wins.get(batch.block, {}), batch)
        answers = sum(batch.sessions.values())
        if any(won < -_CLOSE for won in wins.values()) or abs(sum(wins.values()) - answers) > _CLOSE * (1 + answers):
            raise RecordError(f"the wins of this and of earlier batches are not those of {answers} answers")
        if wins_digest(wins) != batch.wins_sha256:
            raise RecordError("the wins of this and of earlier batches are not those of 'wins_sha256'")
        self._wins[batch.block], self._last[batch.block] = wins, batch
        return batch

    def check(self, trial: Trial) -> None:
        """Compare a first attempt at a trial with the pair that was chosen for it.

        Raises
        ------
        RecordError
            If it asks another pair, or none was chosen for it although there was for an earlier trial of its block.
        """
        batch = self._last.get(trial.block)
        if batch is None:
            return
        number = trial.trial - batch.trial
        if number >= len(batch.pairs):
            raise RecordError(f"no record says which pair was chosen for trial {trial.trial} of block {trial.block}")
        due = tuple(batch.stimuli[index] for index in batch.pairs[number])
        if trial.stimuli != due:
            asked = " with ".join(f"'{name}'" for name in trial.stimuli)
            raise RecordError(f"it compares {asked}, and the pair chosen was '{due[0]}' with '{due[1]}'")


def after_changes(wins: Mapping[tuple[str, str], float], batch: PooledBatch) -> Wins:
    """Return the numbers of wins by (winner, loser) that were known when ``batch`` was chosen; before it, ``wins``."""
    after = dict(wins)
    for winner, loser, change in batch.changes:
        pair = batch.stimuli[winner], batch.stimuli[loser]
        after[pair] = after.get(pair, 0.0) + change
    return {pair: won for pair, won in after.items() if won}


def _check_pairs(pairs: Sequence[tuple[int, ...]], count: int) -> None:
    for first, second in pairs:
        if first == second or max(first, second) >= count:
            raise RecordError(f"[{first}, {second}] is no pair of {count} stimuli")
