"""A log of any kind of session that was changed is refused with the line, by whatever reads it."""

from __future__ import annotations

import json
import random
from pathlib import Path
from typing import Any

import pytest

import cyclopean
from analysis.records import FILE_NAME, check_log, read_session, session_files
from documents import InputError
from tests.runner.changed_logs import EDITS, edit, flip, recorded, refused
from tests.runner.every_kind import VARIANTS

Study = Any  # tests/conftest.py
FLIPS = 4  # more, and of more logs: tests/stress


@pytest.mark.parametrize(("kind", "variant"), VARIANTS)
def test_flipped_bits_and_edited_lines_are_named(kind: str, variant: int, tmp_path: Path) -> None:
    rng = random.Random(f"{kind}/{variant}")
    end = rng.random() < 0.7
    lines, other = (recorded(tmp_path, kind, variant, observer, end=end) for observer in ("01", "02"))
    file = tmp_path / FILE_NAME
    file.write_bytes(b"".join(lines))
    assert check_log(file).findings == ()
    assert read_session(file).complete is end
    for _ in range(FLIPS):
        refused(file, *flip(rng, lines))
    for what in EDITS:
        refused(file, *edit(rng, what, lines, other))


def test_a_log_that_was_cut_has_stopped_and_gives_no_other_answers(tmp_path: Path) -> None:
    lines = recorded(tmp_path, "all_pairs", 0, "01")
    content, file = b"".join(lines), tmp_path / FILE_NAME
    file.write_bytes(content)
    answers = read_session(file).answers
    rng = random.Random(1)
    for cut in rng.sample(range(len(lines[0]) + 1, len(content) - 1), 60):
        file.write_bytes(content[:cut])
        checked = check_log(file)
        assert (checked.findings, checked.complete) == ((), False)
        assert checked.torn_bytes == 0 or content[:cut].endswith(file.read_bytes()[-checked.torn_bytes :])
        log = read_session(file)
        assert log.answers == answers[: len(log.answers)]
        assert not log.complete


@pytest.fixture
def changed(study: Study) -> tuple[Study, Path, bytes]:
    """A study with a session that stopped, of which the answer in line 4 was exchanged."""
    study.cyclopean(
        "run", study.experiment, "--observer", "01", "--results", study.results, "--simulate", study.observers
    )
    (file,) = session_files(study.results)
    lines = file.read_bytes().splitlines(keepends=True)
    answer = json.loads(lines[3])["answer"]
    assert answer in ("first", "second")
    other = b'"second"' if answer == "first" else b'"first"'
    lines[3] = lines[3].replace(b'"answer":"%s"' % answer.encode(), b'"answer":' + other)
    file.write_bytes(b"".join(lines[:-2]))
    return study, file, b"".join(lines)


def test_every_command_names_the_line(changed: tuple[Study, Path, bytes]) -> None:
    study, file, whole = changed
    run = ["run", study.experiment, "--observer", "01", "--results", study.results, "--simulate", study.observers]
    words = f"{file}:4:1: this line does not fit its checksum: the log was changed after it was recorded"
    remedy = "(restore the file from its mirror or a copy)"
    before = file.read_bytes()
    for command in (
        [*run, "--resume"],
        run,
        [*run[:-2], "--replay", file],
        ["report", study.results, "-o", study.folder / "report.html"],
        ["export", study.results, "-o", study.folder / "bids"],
    ):
        told = study.cyclopean(*command, expect=2)
        assert f"{words} {remedy}" in told.stderr, command
        assert "Traceback" not in told.stderr
        assert "start a new session" not in told.stderr
    assert file.read_bytes() == before
    told = study.cyclopean("verify", study.results, expect=1)
    assert f"error: {words} {remedy}" in told.stderr
    assert "chained, stopped" in told.stdout
    file.write_bytes(whole)
    found = json.loads(study.cyclopean("verify", file, "--json", expect=1).stdout)
    assert [(finding["file"], finding["line"]) for finding in found["findings"]] == [(str(file), 4)]
    assert found["logs"][0]["complete"] is True


def test_logs_that_fit_are_listed(study: Study) -> None:
    for observer in ("01", "02"):
        study.cyclopean(
            "run", study.experiment, "--observer", observer, "--results", study.results, "--simulate", study.observers
        )
    first, second = session_files(study.results)
    second.write_bytes(b"".join(second.read_bytes().splitlines(keepends=True)[:4]) + b'{"record":"tri')
    told = study.cyclopean("verify", study.results).stdout
    digest = json.loads(first.read_bytes().splitlines()[-1])["chain"]
    assert f"{first}: 9 lines, chained, complete, digest {digest}" in told
    assert f"{second}: 4 lines, chained, stopped, its last line unfinished, digest " in told
    assert "2 logs: every checksum fits" in told
    told = study.cyclopean("verify", study.experiment, expect=2).stderr
    assert f"{study.experiment}: this is no log of a session or a measurement" in told
    copy = study.folder / "copied.jsonl"
    copy.write_bytes(first.read_bytes())
    assert "chained, complete" in study.cyclopean("verify", copy).stdout
    second.unlink()
    second.mkdir()
    told = study.cyclopean("verify", study.results, expect=1)
    assert f"{first}: 9 lines" in told.stdout
    assert "this is a folder, not a file" in told.stderr
    assert "folder holds no session.jsonl" in study.cyclopean("verify", study.folder / "cache", expect=2).stderr


def _take_off_checksums(file: Path, **edited: object) -> None:
    """Write a log again without its checksums, as a person with a few lines of Python would, and edit its values."""
    lines = [json.loads(line) for line in file.read_bytes().splitlines()]
    for line in lines:
        for key in ("line", "chain", "lines"):
            line.pop(key, None)
        line.update({key: value for key, value in edited.items() if key in line})
    file.write_text("".join(json.dumps(line) + "\n" for line in lines), encoding="utf-8")


def test_checksums_that_were_taken_off_are_missed(study: Study) -> None:
    run = ["run", study.experiment, "--observer", "01", "--results", study.results, "--simulate", study.observers]
    study.cyclopean(*run)
    (file,) = session_files(study.results)
    assert study.cyclopean("verify", "--strict", study.results).stderr == ""
    _take_off_checksums(file, simulated=False)
    told = study.cyclopean("verify", study.results, expect=1)
    assert f"error: {file}:1:1: " in told.stderr
    assert "fits" not in told.stdout
    found = json.loads(study.cyclopean("verify", file, "--json", expect=1).stdout)
    assert [(finding["file"], finding["line"]) for finding in found["findings"]] == [(str(file), 1)]
    for command in (
        ["report", study.results],
        ["export", study.results, "-o", study.folder / "bids"],
        ["seal", study.results],
        [*run[:-2], "--replay", file],
        [*run, "--resume"],
    ):
        assert f"{file}:1:1: " in study.cyclopean(*command, expect=2).stderr, command
    for read in (cyclopean.read_results, cyclopean.scores):
        with pytest.raises(InputError) as refused:
            read(study.results)
        assert [(finding.file, finding.line) for finding in refused.value.findings] == [(str(file), 1)]


def test_checksums_that_were_taken_off_a_measurement_are_missed(tmp_path: Path, cyclopean: Any) -> None:
    from devices.measurements import MeasurementLog

    file = tmp_path / "display.jsonl"
    with MeasurementLog.create(file, {"steps": []}) as log:
        log.note(remark="begun")
    cyclopean("verify", "--strict", file)
    _take_off_checksums(file, remark="began")
    assert f"error: {file}:1:1: " in cyclopean("verify", file, expect=1).stderr
    assert f"{file}:1" in cyclopean("display", "fit", file, "--mode", "flat", expect=2).stderr


@pytest.mark.usefixtures("undrawn")
def test_an_unchained_log_is_resumed_and_never_said_to_fit(study: Study, unchained: Any) -> None:
    run = ["run", study.experiment, "--observer", "01", "--results", study.results, "--simulate", study.observers]
    study.cyclopean(*run)
    (file,) = session_files(study.results)
    file.write_bytes(b"".join(file.read_bytes().splitlines(keepends=True)[:5]))
    unchained(file)
    told = study.cyclopean("verify", study.results).stdout
    assert ", unchained: nothing protects it, stopped" in told
    assert "1 log is unchained: nothing protects it" in told
    assert "fits" not in told
    assert f"error: {file}: " in study.cyclopean("verify", "--strict", study.results, expect=1).stderr
    assert json.loads(study.cyclopean("verify", "--json", study.results).stdout)["logs"][0]["chained_from"] is None
    report = study.folder / "report.html"
    study.cyclopean("report", study.results, "-o", report)
    notes, methods = report.read_text(encoding="utf-8").split('id="methods"')
    assert "1 log is unchained: nothing protects it" in notes
    assert "1 log is unchained: nothing protects it" in methods
    assert "every checksum fits" not in notes + methods
    study.cyclopean(*run, "--resume")
    told = study.cyclopean("verify", study.results).stdout
    assert "chained from line 6, complete" in told
    assert "1 log was chained when resumed: nothing protected the lines before until then" in told
    study.cyclopean("verify", "--strict", study.results, expect=1)
    study.cyclopean("report", study.results, "-o", report)
    assert report.read_text(encoding="utf-8").count("1 log was chained when resumed") == 3
    file.write_bytes(file.read_bytes().replace(b'"answer":"', b'"answer": "', 1))
    told = study.cyclopean("verify", study.results, expect=1)
    assert f"{file}:6:1: this line does not fit its checksum" in told.stderr
    assert "or in those before it, 1 to 5, which have no checksums" in told.stderr


@pytest.mark.usefixtures("undrawn")
def test_a_report_of_chained_logs_says_that_they_fit(study: Study) -> None:
    study.cyclopean(
        "run", study.experiment, "--observer", "01", "--results", study.results, "--simulate", study.observers
    )
    report = study.folder / "report.html"
    study.cyclopean("report", study.results, "-o", report)
    notes, methods = report.read_text(encoding="utf-8").split('id="methods"')
    assert "every checksum fits" in methods
    assert "unchained" not in notes + methods


def test_verify_lists_every_changed_line_and_measurements_and_seals(study: Study, tmp_path: Path) -> None:
    from devices.measurements import MeasurementLog

    run = ["run", study.experiment, "--observer", "01", "--results", study.results, "--simulate", study.observers]
    study.cyclopean(*run)
    with MeasurementLog.create(study.results / "display.jsonl", {"steps": []}) as log:
        log.note(remark="begun")
    study.cyclopean("seal", study.results)
    told = study.cyclopean("verify", study.results).stdout
    assert "display.jsonl: 2 lines, chained, a measurement, digest " in told
    assert "seal.json: sealed 20" in told
    assert ", as sealed, not signed, SHA-256 " in told
    (file,) = session_files(study.results)
    lines = file.read_bytes().splitlines(keepends=True)
    for number in (2, 5, 7):
        lines[number - 1] = lines[number - 1].replace(b'"utc":"2', b'"utc":"3', 1)
    file.write_bytes(b"".join(lines))
    measured = study.results / "display.jsonl"
    measured.write_bytes(measured.read_bytes().replace(b"begun", b"began"))
    found = json.loads(study.cyclopean("verify", study.results, "--json", expect=1).stdout)["findings"]
    lines_of = [(finding["file"], finding["line"]) for finding in found]
    assert lines_of == [
        *((str(file), number) for number in (2, 5, 7)),
        (str(measured), 2),
        (str(measured), None),
        (str(file), None),
    ]
