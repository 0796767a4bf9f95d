"""A log of any kind of session that was changed is refused with the line, by whatever reads it."""

from __future__ import annotations

import json
import random
from pathlib import Path
from typing import Any

import pytest

import cyclopean
from analysis.records import FILE_NAME, read_session, session_files
from analysis.seals import check_log
from devices.readings import MeasurementLog
from documents import InputError
from tests.runner.changed_logs import EDITS, edit, flip, recorded, refused
from tests.runner.every_kind import VARIANTS
from tests.runner.families import by_first_way

Study = Any  # tests/conftest.py
FLIPS = 4  # more, and of more logs: tests/stress
UNCHAINED = "1 log is unchained: nothing protects it"


@pytest.mark.parametrize(("kind", "variant"), by_first_way(VARIANTS))
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
    for cut in random.Random(1).sample(range(len(lines[0]) + 1, len(content) - 1), 60):
        file.write_bytes(content[:cut])
        checked = check_log(file)
        assert (checked.findings, checked.complete) == ((), False)
        assert checked.torn_bytes == 0 or content[:cut].endswith(file.read_bytes()[-checked.torn_bytes :])
        log = read_session(file)
        assert log.answers == answers[: len(log.answers)]
        assert not log.complete


def commands(study: Study, file: Path) -> list[list[object]]:
    """Return commands that read the results."""
    run = ["run", study.experiment, "--observer", "01", "--results", study.results]
    return [
        [*run, "--simulate", study.observers, "--resume"],
        [*run, "--replay", file],
        ["report", study.results, "-o", study.folder / "report.html"],
        ["export", study.results, "-o", study.folder / "bids"],
        ["seal", study.results],
    ]


def found(study: Study, place: Path) -> list[tuple[str, int | None]]:
    """Return the places that ``verify`` finds."""
    told = json.loads(study.cyclopean("verify", place, "--json", expect=1).stdout)
    return [(finding["file"], finding["line"]) for finding in told["findings"]]


def test_every_command_names_the_line(study: Study) -> None:
    study.run()
    file = study.log_file()
    lines = file.read_bytes().splitlines(keepends=True)
    answer = json.loads(lines[3])["answer"]
    other = {"first": b'"second"', "second": b'"first"'}[answer]
    lines[3] = lines[3].replace(b'"answer":"%s"' % answer.encode(), b'"answer":' + other)
    before = b"".join(lines[:-2])  # stopped
    file.write_bytes(before)
    for command in (*commands(study, file)[:-1], ["run", *commands(study, file)[0][1:-1]]):
        told = study.cyclopean(*command, expect=2).stderr
        assert f"{file}:4:1: this line does not fit its checksum" in told, command
        assert "(restore the file from its mirror or a copy)" in told
    assert file.read_bytes() == before
    told = study.cyclopean("verify", study.results, expect=1)
    assert f"error: {file}:4:1: " in told.stderr
    assert "chained, stopped" in told.stdout
    file.write_bytes(b"".join(lines))
    assert found(study, file) == [(str(file), 4)]


def test_logs_that_fit_are_listed(study: Study) -> None:
    for observer in ("01", "02"):
        study.run(observer=observer)
    first, second = session_files(study.results)
    second.write_bytes(b"".join(second.read_bytes().splitlines(keepends=True)[:4]) + b'{"record":"tri')
    told = study.cyclopean("verify", study.results).stdout
    digest = json.loads(first.read_bytes().splitlines()[-1])["chain"]
    assert f"{first}: 9 lines, chained, complete, digest {digest}" in told
    assert f"{second}: 4 lines, chained, stopped, its last line unfinished, digest " in told
    assert "2 logs: every checksum fits" in told
    copy = study.folder / "copied.jsonl"
    copy.write_bytes(first.read_bytes())
    assert "chained, complete" in study.cyclopean("verify", copy).stdout
    second.unlink()
    second.mkdir()
    told = study.cyclopean("verify", study.results, expect=1)
    assert f"{first}: 9 lines" in told.stdout
    assert str(second) in told.stderr
    for place in (study.experiment, study.folder / "cache"):  # no log, and a folder without one
        assert str(place) in study.cyclopean("verify", place, expect=2).stderr


def _take_off_checksums(file: Path, **edited: object) -> None:
    """Write a log again without its checksums, as a person with a few lines of Python would, and edit its values."""
    lines = [json.loads(line) for line in file.read_bytes().splitlines()]
    for line in lines:
        for key in ("line", "chain", "lines"):
            line.pop(key, None)
        line.update({key: value for key, value in edited.items() if key in line})
    file.write_text("".join(json.dumps(line) + "\n" for line in lines), encoding="utf-8")


def test_checksums_that_were_taken_off_are_missed(study: Study) -> None:
    study.run()
    file = study.log_file()
    assert study.cyclopean("verify", "--strict", study.results).stderr == ""
    _take_off_checksums(file, simulated=False)
    assert found(study, file) == [(str(file), 1)]
    assert "fits" not in study.cyclopean("verify", study.results, expect=1).stdout
    for command in commands(study, file):
        assert f"{file}:1:1: " in study.cyclopean(*command, expect=2).stderr, command
    for read in (cyclopean.read_results, cyclopean.scores):
        with pytest.raises(InputError) as refused:
            read(study.results)
        assert [(finding.file, finding.line) for finding in refused.value.findings] == [(str(file), 1)]


def test_checksums_that_were_taken_off_a_measurement_are_missed(tmp_path: Path, cyclopean: Any) -> None:
    file = tmp_path / "display.jsonl"
    with MeasurementLog.create(file, {"steps": []}) as log:
        log.note(remark="begun")
    cyclopean("verify", "--strict", file)
    _take_off_checksums(file, remark="began")
    assert f"error: {file}:1:1: " in cyclopean("verify", file, expect=1).stderr
    assert f"{file}:1" in cyclopean("display", "fit", file, "--mode", "flat", expect=2).stderr


@pytest.mark.usefixtures("undrawn")
def test_an_unchained_log_is_resumed_and_never_said_to_fit(study: Study, unchained: Any) -> None:
    study.run()
    file, report = study.log_file(), study.folder / "report.html"
    study.cyclopean("report", study.results, "-o", report, "--no-thumbnails")
    assert "every checksum fits" in report.read_text(encoding="utf-8")
    file.write_bytes(b"".join(file.read_bytes().splitlines(keepends=True)[:5]))
    unchained(file)
    told = study.cyclopean("verify", study.results).stdout
    assert UNCHAINED in told
    assert "fits" not in told
    assert f"error: {file}: " in study.cyclopean("verify", "--strict", study.results, expect=1).stderr
    assert json.loads(study.cyclopean("verify", "--json", study.results).stdout)["logs"][0]["chained_from"] is None
    study.cyclopean("report", study.results, "-o", report, "--no-thumbnails")
    notes, methods = report.read_text(encoding="utf-8").split('id="methods"')
    assert (UNCHAINED in notes, UNCHAINED in methods) == (True, True)
    assert "every checksum fits" not in notes + methods
    study.run("--resume")
    told = study.cyclopean("verify", study.results).stdout
    assert "chained from line 6, complete" in told
    assert "1 log was chained when resumed" in told
    study.cyclopean("verify", "--strict", study.results, expect=1)
    file.write_bytes(file.read_bytes().replace(b'"answer":"', b'"answer": "', 1))
    told = study.cyclopean("verify", study.results, expect=1).stderr
    assert f"{file}:6:1: " in told
    assert "1 to 5" in told  # or in those, which have no checksums


def test_verify_lists_every_changed_line_and_measurements_and_seals(study: Study) -> None:
    study.run()
    measured = study.results / "display.jsonl"
    with MeasurementLog.create(measured, {"steps": []}) as log:
        log.note(remark="begun")
    study.cyclopean("seal", study.results)
    told = study.cyclopean("verify", study.results).stdout
    assert "display.jsonl: 2 lines, chained, a measurement, digest " in told
    assert ", as sealed, not signed, SHA-256 " in told
    file = study.log_file()
    lines = file.read_bytes().splitlines(keepends=True)
    for number in (2, 5, 7):
        lines[number - 1] = lines[number - 1].replace(b'"utc":"2', b'"utc":"3', 1)
    file.write_bytes(b"".join(lines))
    measured.write_bytes(measured.read_bytes().replace(b"begun", b"began"))
    places = [(str(file), 2), (str(file), 5), (str(file), 7), (str(measured), 2), (str(measured), None)]
    assert found(study, study.results) == [*places, (str(file), None)]
