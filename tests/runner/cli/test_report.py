"""`cyclopean report` as it is called."""

from __future__ import annotations

import html
import json
import re
import unicodedata
from functools import partial
from pathlib import Path

import pytest

from runner.reports.results import find_browser
from tests.invoked import invoked
from tests.runner.cli.sessions import NAMES, write_session


@pytest.fixture
def results(tmp_path: Path) -> Path:
    for number in range(1, 6):
        write_session(tmp_path / "results", f"{number:02d}")
    return tmp_path / "results"


run = partial(invoked, "report")


@pytest.mark.usefixtures("undrawn")
def test_json_holds_every_part_and_no_nan(results: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Beside a study's folder its experiment is found."""
    asked = []
    monkeypatch.setattr("runner.reports.results.find_shown", lambda header, file: asked.append(file))
    study = results.parent / "experiment.yaml"
    study.touch()
    told = json.loads(run(results, "--json").stdout)
    assert asked == [study]
    assert told["report"] == str(results / "report.html")
    assert (results / "report.html").is_file()
    assert told["trials"] == 60
    assert [line["observer"] for line in told["observer_table"]["observers"]] == ["01", "02", "03", "04", "05"]
    assert told["left_out"]["left_out"] == {}
    assert told["intervals"]["kind"] == told["covariance"] == "shrinkage"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--without", "99"), "there is no observer '99'"),
        (("--passed", "stereo_acuity"), "nobody took the test of vision 'stereo_acuity'"),
        (("--experiment", "/nowhere.yaml"), "not the stimuli and the display"),
        (("--screened",), "screened goes with passed"),
    ],
)
def test_what_cannot_be_asked_is_told(results: Path, arguments: tuple[str, ...], words: str) -> None:
    done = run(results, *arguments)
    assert done.exit_code != 0
    assert words in done.output + str(done.exception)
    assert not (results / "report.html").exists()


@pytest.mark.usefixtures("undrawn")
def test_tables_and_figures_are_written_and_figures_not_replaced_unasked(results: Path, tmp_path: Path) -> None:
    figures = tmp_path / "figures"
    words = (results, "-o", tmp_path / "out.html", "--figures", figures)
    figures.mkdir()
    (figures / "scores.svg").touch()
    assert "--replace" in str(run(*words).exception)
    done = run(*words, "--replace", "--csv", tmp_path / "tables")
    assert done.exit_code == 0, done.output
    head = (tmp_path / "tables" / "scores.csv").read_text(encoding="utf-8").splitlines()[0]
    assert head == ("stimulus,class,score,log10_score,log10_score_low,log10_score_high,se_nats,wins,comparisons")

    assert f"Its figures: {figures}" in done.output
    names = {file.name for file in figures.iterdir()}
    assert {"scores.svg", "scores.pdf", "classes.svg", "classes.pdf"} <= names
    assert (figures / "scores.svg").read_bytes()
    assert "replace goes with figures" in str(run(results, "--replace").exception)


@pytest.mark.nightly
def test_printed_pages_keep_headings_with_what_follows_and_tables_whole(tmp_path: Path) -> None:
    if find_browser() is None:
        pytest.skip("no Chromium is installed: nothing is printed")
    from pypdf import PdfReader

    for number in range(1, 46):
        write_session(tmp_path / "results", f"{number:02d}")
    done = run(tmp_path / "results", "--pdf", "--csv", tmp_path / "csv")
    assert done.exit_code == 0, done.output
    page = (tmp_path / "results" / "report.html").read_text(encoding="utf-8")
    reader = PdfReader(tmp_path / "results" / "report.pdf")
    assert [round(float(side)) for side in reader.pages[0].mediabox[2:]] == [595, 842]  # A4 in points
    # The font has ligatures.
    texts = [unicodedata.normalize("NFKC", page.extract_text()) for page in reader.pages]
    printed = [[line.strip() for line in text.splitlines() if line.strip()] for text in texts]
    headings = [html.unescape(words) for words in re.findall(r"<h[23]>([^<]*)</h[23]>", page)]
    assert len(headings) > 6
    for heading in headings:
        last = [len(lines) - 1 - number for lines in printed for number, line in enumerate(lines) if line == heading]
        assert last, heading
        assert min(last) >= 2, f"'{heading}' is near the end of its page, away from what follows"
    # A short table is whole: its caption and each of its rows are on one page.
    (scores,) = [lines for lines in printed if "Scores, best first" in lines]
    below = scores[scores.index("Scores, best first") :]
    assert all(any(line.startswith(f"{name} ") for line in below) for name in NAMES)
    # A long one has its head on each page that it reaches.
    rows = [[line for line in lines if re.match(r"\d\d (–|\d|[a-z]).* 1\.00$", line)] for lines in printed]
    assert sum(map(len, rows)) == 45
    reached = [lines for lines, own in zip(printed, rows, strict=True) if own]
    assert len(reached) > 1
    assert all(any(line.startswith("Observer Flags") for line in lines) for lines in reached)


@pytest.mark.nightly
@pytest.mark.usefixtures("undrawn")
def test_pictures_are_taken_for_what_they_are_worth_and_observers_left_out_by_name(
    results: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []
    monkeypatch.setattr("runner.reports.results.find_shown", lambda header, file: asked.append(file))
    monkeypatch.chdir(results)
    (results / "experiments").mkdir()
    (results / "experiments" / "small.yaml").touch()
    done = run(results)
    assert done.exit_code == 0
    assert asked == [results / "experiments" / "small.yaml"]
    assert "5 simulated observers, 60 comparisons of 4 stimuli" in done.output
    assert "The page has no pictures" in done.output
    asked.clear()
    told = json.loads(run(results, "--no-thumbnails", "--without", "02", "--without", "04", "--json").stdout)
    assert not asked
    assert told["observers"] == ["01", "03", "05"]
    assert told["left_out"]["left_out"] == {"02": ["by hand"], "04": ["by hand"]}
    page = (results / "report.html").read_text(encoding="utf-8")
    assert "Left out: 02 (by hand); 04 (by hand)." in page
    assert "no pictures" not in page


@pytest.mark.nightly
@pytest.mark.usefixtures("undrawn")
def test_an_experiments_name_leads_out_of_no_folder(results: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for file in results.rglob("session.jsonl"):
        file.write_text(file.read_text().replace('"experiment": "small"', '"experiment": "../../small"'))
    asked = []
    monkeypatch.setattr("runner.reports.results.find_shown", lambda header, file: asked.append(file))
    monkeypatch.chdir(results)
    (results.parent / "small.yaml").touch()
    assert run(results).exit_code == 0
    assert not asked
