"""Pairs chosen by the answers of all observers: what is known, recorded, replayed, left out and refused."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from analysis.errors import ResultsError
from analysis.records import FILE_NAME, PooledBatch, SessionLog, read_session, session_files
from analysis.scaling import updated_posterior
from analysis.seals import check_log
from documents import counted_work
from runner.ports import ChooseBatch, WindowClosed
from runner.protocol import Experiment, read_experiment
from runner.session import Recorder
from runner.session.pooling import MOST_S, RecordedPool, ResultsPool
from tests.answers import changed
from tests.extensions.adaptive_pairs.pooled_sessions import asked, leave_after, sit
from tests.runner import every_kind as EVERY

Study = Any  # tests/conftest.py
Unchained = Callable[[Path], None]  # the same
POOLED = "kind: active_pairs, trials: 24, pool: results, ties: both"
ALONE = "kind: active_pairs, trials: 24, ties: both"
WORDS = "kind: instructions, text: Look."


@pytest.fixture(scope="module")
def design(tmp_path_factory: pytest.TempPathFactory) -> Experiment:
    return EVERY.experiment(tmp_path_factory.mktemp("study"), WORDS, POOLED)


@pytest.fixture
def results(tmp_path: Path) -> Path:
    return tmp_path / "results"


@pytest.fixture(scope="module")
def recorded(design: Experiment, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The results of observer 01, seed 1."""
    results = tmp_path_factory.mktemp("recorded") / "results"
    sit(design, results, "01", seed=1)
    return results


@pytest.fixture
def first(recorded: Path, results: Path) -> SessionLog:
    """The log of observer 01, copied into the results of the test."""
    shutil.copytree(recorded, results)
    return read_session(next(results.rglob(FILE_NAME)))


def wins_of(logs: list[SessionLog], names: tuple[str, ...]) -> np.ndarray:
    """Count the wins in ``logs``, a tie as half a win for each: the slow, obvious way."""
    wins = np.zeros((len(names), len(names)))
    for log in logs:
        for trial in log.trials:
            if trial.kind == "active_pairs":
                i, j = names.index(trial.details()["first"]), names.index(trial.details()["second"])
                won = {"first": 1.0, "second": 0.0}.get(trial.details()["answer"], 0.5)
                wins[i, j] += won
                wins[j, i] += 1 - won
    return wins


def known_by(log: SessionLog, batch: int) -> np.ndarray:
    """Return the wins that were known when a batch was chosen, by the log's records alone."""
    wins = np.zeros((6, 6))
    for one in log.pooled[: batch + 1]:
        assert one.stimuli == tuple("abcdef")
        for winner, loser, change in one.changes:
            wins[winner, loser] += change
    return wins


def test_each_batch_knows_what_the_others_had_answered_and_not_its_own_answers_twice(
    design: Experiment, results: Path, first: SessionLog
) -> None:
    stopped = sit(design, results, "02", leave_after(9), seed=2)
    assert not stopped.complete
    second = sit(design, results, "03", seed=3)
    assert [batch.sessions for batch in first.pooled] == [{}] * len(first.pooled)
    everybody = {f"01/{first.header.session}": 24, f"02/{stopped.header.session}": 8}
    for number, batch in enumerate(second.pooled):
        assert batch.sessions == everybody
        assert np.array_equal(known_by(second, number), wins_of([first, stopped], tuple("abcdef")))
    assert [len(batch.changes) > 0 for batch in second.pooled] == [True, *[False] * (len(second.pooled) - 1)]
    assert [batch.trial for batch in second.pooled] == np.cumsum([0, *(len(b.pairs) for b in second.pooled)])[
        :-1
    ].tolist()


def test_answers_that_come_in_the_meantime_are_known_from_the_next_batch_on(design: Experiment, results: Path) -> None:
    """Another station records while this one asks: between its batches, not within them."""
    others: list[SessionLog] = []

    def before(given: int) -> None:
        if given in (1, 5, 14):
            others.append(sit(design, results, f"1{given}", leave_after(7), seed=given))

    log = sit(design, results, "01", before, seed=3)
    known = [sum(batch.sessions.values()) for batch in log.pooled]
    assert known[0] == 0
    assert known[-1] == 18
    assert sorted(known) == known
    assert len({*known}) > 2
    assert np.array_equal(known_by(log, len(known) - 1), wins_of(others, tuple("abcdef")))


def test_the_record_is_that_of_the_posterior_of_all_answers(
    design: Experiment, results: Path, first: SessionLog
) -> None:
    second = sit(design, results, "02", leave_after(12), seed=2)
    batch = second.pooled[-1]
    before = replace(second, records=tuple(a for a in second.answers if a.place < batch.place))
    posterior = updated_posterior(wins_of([first, before], tuple("abcdef")))
    assert batch.mean_nats == pytest.approx(posterior.theta, abs=2e-6)
    assert batch.sd_nats == pytest.approx(np.sqrt(np.diag(posterior.covariance)), abs=2e-6)


def test_with_the_same_folder_the_same_seed_makes_the_same_session(
    design: Experiment, results: Path, first: SessionLog
) -> None:
    copy = results.with_name("copy")
    shutil.copytree(results, copy)
    one, other = sit(design, results, "02", seed=2), sit(design, copy, "02", seed=2)
    assert asked(one) == asked(other)
    assert [batch.pairs for batch in one.pooled] == [batch.pairs for batch in other.pooled]
    # And what others answered does decide which pairs come.
    assert asked(sit(design, results.with_name("empty"), "02", seed=2)) != asked(one)


@pytest.mark.parametrize(
    "given", [10, *(pytest.param(given, marks=pytest.mark.nightly) for given in (1, 4, 7, 13, 16, 19, 22))]
)
def test_a_resumed_session_takes_its_batch_from_its_log_although_others_went_on(
    design: Experiment, results: Path, first: SessionLog, given: int
) -> None:
    stopped = sit(design, results, "02", leave_after(given), seed=2, label="stopped")
    sit(design, results, "03", seed=3)
    resumed = sit(design, results, "02", seed=2, label="stopped")
    assert resumed.complete
    assert resumed.pooled[: len(stopped.pooled)] == stopped.pooled
    assert asked(resumed)[: len(asked(stopped))] == asked(stopped)
    batch = stopped.pooled[-1]
    pairs = [(batch.stimuli[first], batch.stimuli[second]) for first, second in batch.pairs]
    assert asked(resumed)[batch.trial : batch.trial + len(pairs)] == pairs
    later = resumed.pooled[len(stopped.pooled) :]
    assert all(sum(one.sessions.values()) == 48 for one in later)


class _Nowhere:
    """A pool that must not be asked."""

    def batch(self, block: int, trial: int, step: ChooseBatch) -> PooledBatch:
        raise AssertionError("the folder is looked at although the log says what was chosen")


def test_what_is_logged_is_replayed_without_the_folder(
    design: Experiment, results: Path, first: SessionLog, tmp_path: Path
) -> None:
    whole = sit(design, results, "02", seed=2, label="whole")
    alone = tmp_path / "elsewhere"
    shutil.copytree(results / "every_kind" / "sub-02", alone / "every_kind" / "sub-02")
    file = alone / "every_kind" / "sub-02" / "ses-whole" / FILE_NAME
    lines = file.read_text().splitlines(keepends=True)
    file.write_text("".join(lines[:-1]))  # all but its end
    again = sit(design, alone, "02", label="whole", pool=_Nowhere())
    assert again.complete
    assert again.answers == whole.answers
    # A replay makes another session with the same batches.
    replayed = sit(design, tmp_path / "replayed", "02", seed=2, pool=RecordedPool(whole))
    assert asked(replayed) == asked(whole)
    assert [b.pairs for b in replayed.pooled] == [b.pairs for b in whole.pooled]
    assert replayed.pooled[0].sessions == whole.pooled[0].sessions
    stopped = replace(whole, pooled=whole.pooled[:1])
    with pytest.raises(WindowClosed):
        sit(design, tmp_path / "stopped", "02", seed=2, pool=RecordedPool(stopped))


def test_a_log_that_lacks_a_batch_is_not_resumed(design: Experiment, results: Path, unchained: Unchained) -> None:
    sit(design, results, "01", leave_after(12), label="cut")
    file = results / "every_kind/sub-01/ses-cut" / FILE_NAME
    unchained(file)
    kept = [line for line in file.read_text().splitlines() if '"record":"pool"' not in line]
    file.write_text("".join(line + "\n" for line in kept))
    with pytest.raises(Exception, match="which pairs were chosen"):
        sit(design, results, "01", label="cut")


def write_again(file: Path, change: str, to: str) -> None:
    """Change a word of the first batch in a log; the other lines stay."""
    lines = file.read_text().splitlines()
    place = next(number for number, line in enumerate(lines) if '"record":"pool"' in line)
    assert change in lines[place]
    lines[place] = lines[place].replace(change, to, 1)
    file.write_text("".join(line + "\n" for line in lines))


CHANGED = ("pairs", "sessions", "changes", "wins_sha256", "mean_nats", "trial", "stimuli")


@pytest.mark.parametrize(
    ("what", "sealed"),
    [
        *((what, False) for what in CHANGED),
        ("mean_nats", True),
        # To a checksum all are alike.
        *(pytest.param(what, True, marks=pytest.mark.nightly) for what in CHANGED if what != "mean_nats"),
    ],
)
def test_a_changed_record_is_noticed(
    design: Experiment, results: Path, first: SessionLog, what: str, sealed: bool, unchained: Unchained
) -> None:
    """By its checksum, and where there is none, by what it says beside the rest of the log."""
    log = sit(design, results, "02", leave_after(10), seed=2)
    batch = log.pooled[0].to_json()
    name = log.file.parts[-3]
    other = {
        "pairs": ('"pairs":[[{},{}]'.format(*batch["pairs"][0]), '"pairs":[[{1},{0}]'.format(*batch["pairs"][0])),
        "sessions": (":24}", ":23}"),
        "changes": ('"changes":[[0,', '"changes":[[9,'),
        "wins_sha256": ('"wins_sha256":"' + batch["wins_sha256"][:3], '"wins_sha256":"xyz'),
        "mean_nats": ('"mean_nats":[', '"mean_nats":[0.5,'),
        "trial": ('"trial":0', '"trial":1'),
        "stimuli": ('"stimuli":["a","b"', '"stimuli":["b","b"'),
    }[what]
    assert name == "sub-02"
    assert not check_log(log.file).findings
    if not sealed:
        unchained(log.file)
    write_again(log.file, *other)
    with pytest.raises(ResultsError):
        read_session(log.file)
    assert check_log(log.file).findings


def test_a_damaged_log_is_left_out_with_a_note_and_the_session_goes_on(
    design: Experiment, results: Path, first: SessionLog
) -> None:
    good = first
    bad = sit(design, results, "02", seed=2)
    text = bad.file.read_text()
    bad.file.write_text(text.replace('"answer":"first"', '"answer":"second"', 1))
    log = sit(design, results, "03", seed=3)
    assert log.complete
    assert {*log.pooled[-1].sessions} == {f"01/{good.header.session}"}
    (note,) = [note for note in log.notes if note.by == "program"]
    assert str(bad.file) in note.text


def test_half_a_line_and_half_a_header_are_not_read_until_they_are_whole(
    design: Experiment, results: Path, first: SessionLog
) -> None:
    other = first
    data = other.file.read_bytes()
    whole = data.splitlines(keepends=True)
    (block,) = [index for index, spec in enumerate(design.spec.blocks) if spec.kind == "active_pairs"]
    pool = ResultsPool(design, results)
    for size in (10, len(whole[0]) - 1, len(whole[0]), len(whole[0]) + 20, len(data) // 2, len(data) - 1, len(data)):
        other.file.write_bytes(data[:size])
        pool.look()
        fresh = ResultsPool(design, results)
        fresh.look()
        lines = whole[1 : data[:size].count(b"\n")]
        due = sum(b'"kind":"active_pairs"' in line for line in lines)
        for one in (pool, fresh):
            assert not one.left_out()
            assert sum(one.answers(block, tuple("abcdef")).sessions.values()) == due
    assert due == 24


def test_the_program_looks_into_the_pool_too(study: Study) -> None:
    study.edit("small.yaml", "kind: all_pairs, break_every: 4", "kind: active_pairs, trials: 6, pool: results")
    for observer in ("01", "02"):
        study.run(observer=observer)
    logs = {log.header.observer: log for log in map(read_session, session_files(study.results))}
    assert [sum(logs[code].pooled[0].sessions.values()) for code in ("01", "02")] == [0, 6]


def test_a_station_that_vanishes_takes_its_answers_along(design: Experiment, results: Path, first: SessionLog) -> None:
    gone = first

    def before(given: int) -> None:
        if given == 5 and gone.file.exists():
            shutil.rmtree(gone.file.parents[1])

    log = sit(design, results, "02", before, seed=2)
    assert sum(log.pooled[0].sessions.values()) == 24
    assert log.pooled[-1].sessions == {}
    assert not known_by(log, len(log.pooled) - 1).any()
    assert read_session(log.file).complete


def test_a_log_that_was_put_back_to_an_earlier_state_counts_as_it_is(
    design: Experiment, results: Path, first: SessionLog
) -> None:
    other = first
    data = other.file.read_bytes()
    pool = ResultsPool(design, results)
    pool.look()
    cut = b"".join(data.splitlines(keepends=True)[:9])
    other.file.write_bytes(cut)
    pool.look()
    assert np.array_equal(pool.answers(1, tuple("abcdef")).wins, wins_of([read_session(other.file)], tuple("abcdef")))
    other.file.write_bytes(data)
    pool.look()
    assert pool.answers(1, tuple("abcdef")).wins.sum() == 24


def test_an_answer_that_was_given_once_more_counts_once_and_a_copy_not_at_all(
    design: Experiment, results: Path
) -> None:
    other = sit(design, results, "01", leave_after(6), seed=1)
    data = {key: value for key, value in other.answers[-1].details().items() if key not in ("chosen", "rejected")}
    again = changed(other.answers[-1], attempt=1, data={**data, "answer": "no_difference"})
    recorder, _ = Recorder.reopen(other.file.parent)
    with recorder:
        recorder.append(again)
    shutil.copytree(other.file.parent, results / "every_kind" / "copy of sub-01" / other.file.parent.name)
    pool = ResultsPool(design, results)
    pool.look()
    found = pool.answers(1, tuple("abcdef"))
    assert sum(found.sessions.values()) == 5
    assert np.array_equal(found.wins, wins_of([read_session(other.file)], tuple("abcdef")))
    assert 0.5 in found.wins


def test_simulated_observers_are_not_pooled_with_people(design: Experiment, results: Path, first: SessionLog) -> None:
    for simulated, answers in ((False, 24), (True, 0)):
        pool = ResultsPool(design, results, simulated=simulated)
        pool.look()
        assert pool.answers(1, tuple("abcdef")).wins.sum() == answers


OTHERS = {
    "other stimuli": ("recipe", "name: f,", "name: g,", "shows other stimuli: 'f' is only in it"),
    "another question": ("experiment", "Which is closer?", "Which is better?", "asks another question"),
    "other blocks": ("blocks", "", "", "has other blocks: its block 2 is 'all_pairs'"),
    "other pairs": ("pairs", "", "", "compares"),
}


@pytest.mark.parametrize("which", OTHERS)
def test_a_folder_of_another_experiment_is_refused_in_one_message(tmp_path: Path, results: Path, which: str) -> None:
    what, old, new, words = OTHERS[which]
    block = {"blocks": "kind: all_pairs", "pairs": ALONE}.get(what, POOLED)
    before = EVERY.experiment(tmp_path / "before", WORDS, block)
    for observer in ("01", "02"):
        sit(before, results, observer, seed=1)
    now = POOLED + ", stimuli: [a, b, c]" if what == "pairs" else POOLED
    file = EVERY.write(tmp_path / "now", WORDS, now)
    changed = file.with_name("recipe.yaml") if what == "recipe" else file
    changed.write_text(changed.read_text().replace(old, new) if old else changed.read_text())
    design = read_experiment(file)
    pool = ResultsPool(design, results)
    pool.look()
    with pytest.raises(Exception, match=words) as refused:
        pool.refuse_foreign()
    message = str(refused.value)
    assert message.count("\n") == 0
    assert f"{results}/every_kind/sub-01/" in message
    assert "(and 1 more sessions there)" in message
    assert "--results" in message


def test_a_foreign_log_that_turns_up_during_a_session_is_left_out_with_a_note(
    design: Experiment, results: Path, tmp_path: Path
) -> None:
    elsewhere = EVERY.write(tmp_path / "other", WORDS, POOLED)
    elsewhere.write_text(elsewhere.read_text().replace("closer", "better"))
    foreign = read_experiment(elsewhere)

    def before(given: int) -> None:
        if given == 3:
            sit(foreign, results, "09", seed=9)

    log = sit(design, results, "01", before, seed=1)
    assert log.complete
    assert all(not batch.sessions for batch in log.pooled)
    assert ["asks another question" in note.text for note in log.notes if note.by == "program"] == [True]


def test_answers_recorded_without_a_pool_count_too(tmp_path: Path, results: Path, design: Experiment) -> None:
    """Whoever turns it on in the middle of a study keeps the answers so far."""
    alone = EVERY.experiment(tmp_path / "alone", WORDS, ALONE)
    sit(alone, results, "01", seed=1)
    assert sum(sit(design, results, "02", seed=2).pooled[0].sessions.values()) == 24
    assert EVERY.experiment(tmp_path / "same", WORDS, ALONE + ", pool: none").digest == alone.digest
    assert design.digest != alone.digest


def test_only_what_was_added_is_read_and_trials_do_not_wait(design: Experiment, results: Path) -> None:
    """Logs of six observers: read whole at the beginning, and then a batch's lines only, however many there are."""
    for observer in range(6):
        sit(design, results, f"{observer:02d}", leave_after(6), seed=observer)
    pool = ResultsPool(design, results)
    with counted_work() as first:
        pool.look()
    with counted_work() as again:
        pool.look(MOST_S)
    assert first["trials_read"] == 6 * 6
    assert again.get("trials_read", 0) == 0
    sit(design, results, "99", leave_after(6), seed=99)
    with counted_work() as news:
        pool.look(MOST_S)
    assert news["trials_read"] == 6


def test_the_time_of_reading_is_bounded_and_what_was_left_comes_next(design: Experiment, results: Path) -> None:
    for observer in range(6):
        sit(design, results, f"{observer:02d}", leave_after(8), seed=observer)
    pool = ResultsPool(design, results)
    seen = []
    for _ in range(6):
        pool.look(most_s=0.0)  # one log at a time
        seen.append(len(pool.answers(1, tuple("abcdef")).sessions))
    assert seen == [1, 2, 3, 4, 5, 6]
