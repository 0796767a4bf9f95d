"""Nothing answered is lost, nothing is counted twice."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from analysis.errors import ResultsError
from analysis.records import FILE_NAME, Header, Trial, read_session
from runner.errors import SessionError
from runner.session.folders import Recorder

HEADER = Header(
    experiment="e",
    observer="01",
    session="s",
    started_utc="2026-01-01T00:00:00+00:00",
    seed=0,
    question="Which — µ?",
    simulated=True,
    stimuli=({"name": "a"}, {"name": "b é"}),
    display={},
    analysis={},
    hashes={},
    software={},
    presentation={},
)


def _trial(number: int) -> Trial:
    data = {"first": "a", "second": "b é", "answer": "first", "chosen": "a", "rejected": "b é"}
    return Trial(0, number, "all_pairs", (("up", 1.25),), 1.25, "2026-01-01T00:00:01+00:00", data)


def _session(folder: Path, trials: int) -> Path:
    with Recorder.create(folder, HEADER) as recorder:
        for number in range(trials):
            recorder.append(_trial(number))
    return folder / FILE_NAME


def test_what_is_written_is_what_is_read(tmp_path: Path) -> None:
    file = _session(tmp_path / "s", 3)
    log = read_session(file)
    assert log.header == HEADER
    assert log.trials == tuple(_trial(number) for number in range(3))
    assert not log.complete


def test_an_answer_is_synced_before_append_returns(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    synced: list[int] = []
    log = tmp_path / "s" / FILE_NAME
    with Recorder.create(log.parent, HEADER) as recorder:
        real = os.fsync

        def counted(descriptor: int) -> None:
            real(descriptor)
            if (written := os.fstat(descriptor)).st_ino == log.stat().st_ino:  # not a copy that is made meanwhile
                synced.append(written.st_size)

        monkeypatch.setattr(os, "fsync", counted)
        recorder.append(_trial(0))
        assert synced == [log.stat().st_size]


def test_a_log_cut_at_any_byte_of_its_last_line_reopens(tmp_path: Path) -> None:
    file = _session(tmp_path / "s", 3)
    content = file.read_bytes()
    start = content[:-1].rindex(b"\n") + 1
    # Each byte near the ends of the line, and each seventh between.
    cuts = [cut for cut in range(start, len(content)) if cut % 7 == 0 or min(cut - start, len(content) - cut) < 9]
    for cut in cuts:
        file.write_bytes(content[:cut])
        recorder, log = Recorder.reopen(file.parent)
        with recorder:
            whole = cut >= len(content) - 1
            assert len(log.trials) == (3 if whole else 2)
            recorder.append(_trial(len(log.trials)))
        assert [trial.trial for trial in read_session(file).trials] == list(range(len(log.trials) + 1))
        assert read_session(file).torn_tail == b""


def test_what_was_torn_off_is_kept(tmp_path: Path) -> None:
    file = _session(tmp_path / "s", 2)
    with open(file, "ab") as stream:
        stream.write(b'{"record":"tri')
    recorder, _ = Recorder.reopen(file.parent)
    recorder.close()
    (kept,) = file.parent.glob("torn-*.bin")
    assert kept.read_bytes() == b'{"record":"tri'


def test_damage_before_the_last_line_is_refused_with_its_line(
    tmp_path: Path, unchained: Callable[[Path], None]
) -> None:
    file = _session(tmp_path / "s", 3)
    unchained(file)
    lines = file.read_bytes().split(b"\n")
    lines[2] = lines[2][:20]
    file.write_bytes(b"\n".join(lines))
    with pytest.raises(ResultsError, match=r"session.jsonl:3:1: this line is not a session record"):
        read_session(file)


def test_two_processes_cannot_write_one_session(tmp_path: Path) -> None:
    with Recorder.create(tmp_path / "s", HEADER):
        code = (
            "import sys; from pathlib import Path\n"
            "from runner.session.folders import Recorder; from runner.errors import SessionError\n"
            "try: Recorder.reopen(Path(sys.argv[1]))\n"
            "except SessionError as error: print(error)"
        )
        told = subprocess.run([sys.executable, "-c", code, str(tmp_path / "s")], capture_output=True, text=True)
    assert "another process is running this session" in told.stdout
    recorder, _ = Recorder.reopen(tmp_path / "s")
    recorder.close()


def test_an_existing_session_is_never_overwritten(tmp_path: Path) -> None:
    file = _session(tmp_path / "s", 1)
    before = file.read_bytes()
    with pytest.raises(SessionError, match="exists already"):
        Recorder.create(tmp_path / "s", HEADER)
    assert file.read_bytes() == before


def test_a_full_disk_is_an_error_and_loses_nothing(tmp_path: Path) -> None:
    """A file-size limit makes the write fall short exactly as a full disk does."""
    code = (
        "import resource, signal, sys\nfrom pathlib import Path\n"
        "from tests_support import HEADER, _trial\nfrom runner.session.folders import Recorder\n"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "recorder = Recorder.create(Path(sys.argv[1]), HEADER)\n"
        "size = (Path(sys.argv[1]) / 'session.jsonl').stat().st_size\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (size + 500, size + 500))\n"
        "done = 0\n"
        "try:\n"
        "    while True:\n"
        "        recorder.append(_trial(done)); done += 1\n"
        "except OSError as error: print(done, error)\n"
    )
    support = tmp_path / "tests_support.py"
    support.write_text(Path(__file__).read_text())
    folder = tmp_path / "s"
    told = subprocess.run(
        [sys.executable, "-c", code, str(folder)],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        check=True,
    )
    done = int(told.stdout.split()[0])
    assert done >= 1
    assert "disk full" in told.stdout or "too large" in told.stdout
    recorder, log = Recorder.reopen(folder)
    with recorder:
        assert len(log.trials) == done
        recorder.append(_trial(done))
    assert len(read_session(folder / FILE_NAME).trials) == done + 1
