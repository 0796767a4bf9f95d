"""Methods answer what journals ask, item by item: by the records, the computation, the study's file, or by a blank."""

from __future__ import annotations

import csv
import html
import json
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

import cyclopean as house
from analysis.choices import Adjust
from analysis.records import read_results, read_session
from analysis.report import METHODS_ITEMS, describe
from analysis.scaling.robust_tests import DRAWS
from runner.protocol import read_experiment
from runner.session import Recorder, Session
from tests.answers import altered
from tests.runner import every_kind
from tests.runner.every_kind import HEADER, Stage

DOCS = Path(__file__).parents[2] / "docs"
ITEMS = {item.code: item for item in METHODS_ITEMS}
DISPLAY = {
    "file": "screen.yaml",
    "mode": "flat",
    "source": "a spectroradiometer",
    "distance_mm": 650.0,
    "ambient_XYZ_cd_m2": {"left": [0.2, 0.25, 0.2], "right": [0.2, 0.25, 0.2]},
}
pytestmark = pytest.mark.usefixtures("undrawn")


@dataclass(frozen=True)
class Told:
    """What `report` wrote of Methods."""

    items: Mapping[str, Mapping[str, Any]]
    missing: tuple[str, ...]
    page: str
    table: tuple[Mapping[str, str], ...]

    @property
    def blanks(self) -> tuple[str, ...]:
        """The blanks that the page marks."""
        return tuple(map(html.unescape, re.findall(r'<mark class="blank">(.*?)</mark>', self.page)))

    def status(self, code: str) -> str:
        return str(self.items[code]["status"])

    def answer(self, code: str) -> str:
        return str(self.items[code]["answer"])


@pytest.fixture
def report(cyclopean: Callable[..., Any], tmp_path: Path) -> Callable[..., Told]:
    """Report on results by the command."""

    def run(results: Path, *words: object) -> Told:
        tables = tmp_path / "tables"
        done = cyclopean("report", results, "--json", "--no-thumbnails", "--csv", tables, *words)
        methods = json.loads(done.stdout)["methods"]
        rows = tuple(csv.DictReader((tables / "methods.csv").read_text(encoding="utf-8").splitlines()))
        items = {item["code"]: item for item in methods["items"]}
        missing = tuple(item["code"] for item in methods["missing"])
        return Told(items, missing, (results / "report.html").read_text(encoding="utf-8"), rows)

    return run


def record(
    results: Path, kind: str, variant: int = 0, observers: int = 3, more: tuple[str, ...] = (), **header: Any
) -> Path:
    """Record sessions of people with a block of the kind, and of ``more`` kinds before it."""
    for number in range(1, observers + 1):
        observer = f"{number:02d}"
        own = {"simulated": False, "experiment": "every_kind", "started_utc": "2026-01-01T00:00:00.000Z", **header}
        place = results / "every_kind" / f"sub-{observer}" / f"ses-{observer}"
        blocks = [block for one in more for block in every_kind.blocks_of(one, 0, observer)[1:2]]
        blocks += every_kind.blocks_of(kind, variant, observer)[1:2]
        with Recorder.create(place, altered(HEADER, observer=observer, session=f"s{observer}", **own)) as recorder:
            Session(tuple(blocks), Stage(), every_kind.Fickle(number), recorder).run()
    return results


@pytest.mark.parametrize(
    ("kind", "variant"),
    [
        ("rating", 0),
        *(
            pytest.param(kind, variant, marks=pytest.mark.nightly)
            for kind, variant in (
                ("all_pairs", 2),
                ("all_pairs", 4),
                ("threshold", 0),
                ("best_of_series", 1),
                ("preference", 0),
            )
        ),
    ],
)
def test_each_item_is_answered_or_a_blank(kind: str, variant: int, tmp_path: Path, report: Callable[..., Told]) -> None:
    told = report(record(tmp_path / "results", kind, variant))
    assert list(told.items) == list(ITEMS)
    assert [row["item"] for row in told.table] == list(ITEMS)
    assert tuple(code for code, item in told.items.items() if item["status"] == "missing") == told.missing
    assert told.blanks == tuple(ITEMS[code].blank for code in told.missing)
    words = html.unescape(re.sub(r"<[^>]*>", "", told.page))
    for code, item in told.items.items():
        assert (item["answer"] is None) == (code in told.missing)
        assert (item["answer"] or ITEMS[code].blank) in words, code
    computed = {code for code, item in ITEMS.items() if item.source == "computed"}
    assert {code for code in told.items if told.status(code) == "computed"} == computed
    assert {code for code, item in ITEMS.items() if item.source == "given"} - {"age", "gender"} <= set(told.missing)


def test_what_was_recorded_is_no_blank_and_what_was_not_is_one(tmp_path: Path, report: Callable[..., Told]) -> None:
    recorded = {"age", "gender", "vision", "display", "viewing", "room", "colours", "timing"}
    presentation = {"timing": {"verification": "verified with a photodiode"}}
    sure = record(
        tmp_path / "sure",
        "rating",
        more=("questionnaire", "screening"),
        display=DISPLAY,
        presentation=presentation,
    )
    told, bare = report(sure), report(record(tmp_path / "bare", "rating"))
    assert {told.status(code) for code in recorded} == {"recorded"}
    assert {bare.status(code) for code in recorded} == {"missing"}
    assert re.search(r"How old.*3 observers answered: \d+ to \d+ years, median \d+", told.answer("age"))
    assert re.search(r"3 observers answered: (woman|man) \(\d\)", told.answer("gender"))
    assert "650 mm" in told.answer("viewing")
    assert "0.25 cd/m²" in told.answer("room")
    assert "near acuity" in told.answer("vision")


@pytest.mark.nightly
def test_what_so_many_observers_could_show_is_computed_of_pairs(tmp_path: Path, report: Callable[..., Told]) -> None:
    pairs, ratings = report(record(tmp_path / "results", "all_pairs", 2)), report(record(tmp_path / "more", "rating"))
    assert "of studies" in pairs.answer("sensitivity")
    assert "seed 2016" in pairs.answer("sensitivity")
    assert "in 1 study of 4" in pairs.answer("sensitivity")
    assert "simulation of this design" not in pairs.answer("analysis")
    assert not re.search(r"\d", ratings.answer("sensitivity"))
    assert {told.status("sample_size") for told in (pairs, ratings)} == {"missing"}  # people know why


def test_each_distance_is_told(tmp_path: Path, report: Callable[..., Told]) -> None:
    record(tmp_path / "results", "rating", display={**DISPLAY, "distance_mm": 500.0})
    first = tmp_path / "results" / "every_kind" / "sub-01" / "ses-01" / "session.jsonl"
    lines = [json.loads(line) for line in first.read_text().splitlines()]
    lines[0]["display"]["distance_mm"] = 650.0
    first.write_text("".join(json.dumps({k: v for k, v in line.items() if k not in _CHAIN}) + "\n" for line in lines))
    assert "650 mm in 1 session and 500 mm in 2" in report(tmp_path / "results").answer("viewing")


_CHAIN = ("line", "chain", "lines", "chained")
FACTS = "methods: {sample_size: 'By a plan: <b>80 %</b> power.', data: 'osf.io/abc', room: Dark.}\n"


def write_experiment(folder: Path, facts: str) -> Path:
    return every_kind.write(folder, every_kind.written("rating", 0), more=facts)


def test_each_version_that_a_session_was_run_with_is_told(
    tmp_path: Path, report: Callable[..., Told], monkeypatch: pytest.MonkeyPatch
) -> None:
    results = record(tmp_path / "results", "rating", observers=1)
    (log,) = read_results(results)
    log.file.write_bytes(b"".join(log.file.read_bytes().splitlines(keepends=True)[:2]))
    monkeypatch.setattr("runner.session.folders.software", lambda: {"cyclopean": "98.7", "numpy": "1.2"})
    for _ in range(2):  # of the second time nothing is told that was told before
        recorder, _, _ = Recorder.resume(log.file.parent, {})
        recorder.close()
        began, resumed = read_session(log.file).software
        assert began == log.header.software
        assert resumed == {**began, "cyclopean": "98.7", "numpy": "1.2"}
    answer = report(results).answer("software")
    assert "cyclopean 98.7 and numpy 1.2" in answer
    assert "changed within 1 session, on resuming" in answer


def test_the_experiment_file_fills_blanks(tmp_path: Path, report: Callable[..., Told]) -> None:
    file = write_experiment(tmp_path / "study", "")
    hashes = {"experiment": read_experiment(file).digest}
    results = record(tmp_path / "study" / "results", "rating", hashes=hashes)
    before = report(results)
    assert {"sample_size", "data", "room"} <= set(before.missing)
    write_experiment(tmp_path / "study", FACTS).rename(tmp_path / "study" / "experiment.yaml")
    after = report(results)  # found in the study's folder
    assert set(before.missing) - set(after.missing) == {"sample_size", "data", "room"}
    assert {after.status(code) for code in ("sample_size", "data", "room")} == {"given"}
    assert after.answer("sample_size") == "By a plan: <b>80 %</b> power."
    assert "By a plan: &lt;b&gt;80 %&lt;/b&gt; power." in after.page
    assert "<b>80" not in after.page
    assert ITEMS["data"].blank not in after.blanks


def test_facts_are_carried_into_an_exported_dataset(tmp_path: Path, cyclopean: Callable[..., Any]) -> None:
    facts = "methods: {ethics: 'Approved, *2026-17*.', data: osf.io/abc}\n"
    file = write_experiment(tmp_path / "study", facts).rename(tmp_path / "study" / "experiment.yaml")
    made_with = read_experiment(file).digest
    for name, digest, given in (("bids", made_with, True), ("other", "ab" * 32, False)):
        results = record(tmp_path / "study" / f"results_of_{name}", "rating", hashes={"experiment": digest})
        dataset = tmp_path / name
        cyclopean("export", results, "-o", dataset, expect=0)
        house.export_bids(results, folder=dataset)  # which replaces the first
        description = json.loads((dataset / "dataset_description.json").read_text(encoding="utf-8"))
        assert description.get("EthicsApprovals") == (["Approved, *2026-17*."] if given else None)
        assert ("- ethics: Approved, \\*2026-17\\*." in (dataset / "README").read_text(encoding="utf-8")) == given
        carried = list(dataset.glob("sourcedata/*/methods.json"))
        assert [set(json.loads(one.read_text(encoding="utf-8"))) for one in carried] == [{"ethics", "data"}] * given


def test_facts_of_another_experiment_are_not_taken(
    tmp_path: Path, report: Callable[..., Told], cyclopean: Callable[..., Any]
) -> None:
    file = write_experiment(tmp_path / "study", FACTS).rename(tmp_path / "study" / "experiment.yaml")
    results = record(tmp_path / "study" / "results", "rating", hashes={"experiment": "ab" * 32})
    assert report(results).status("data") == "missing"
    assert report(results, "--experiment", file).status("data") == "given"  # who names it means it
    file.write_text(file.read_text().replace("name: every_kind", "name: other"))
    refused = cyclopean("report", results, "--no-thumbnails", "--experiment", file, expect=2)
    assert f"{file}:2:" in refused.stderr


@pytest.mark.parametrize(
    ("fact", "place"),
    [("sampel_size: 12", "sampel_size"), ("draws: 5", "draws"), ("data: ''", "data"), ("data: [a]", "data")],
)
def test_a_wrong_fact_is_named(fact: str, place: str, tmp_path: Path, cyclopean: Callable[..., Any]) -> None:
    file = write_experiment(tmp_path, f"methods: {{{fact}}}\n")
    done = cyclopean("check", file, "--json", expect=2)
    (told,) = (one for one in json.loads(done.stdout)[0]["findings"] if place in one["message"])
    assert (told["file"], told["line"]) == (str(file), len(file.read_text().splitlines()))


@pytest.mark.parametrize(
    ("adjust", "tests"),
    [
        ("holm", "6 differences between 4 stimuli"),
        pytest.param("none", "with no", marks=pytest.mark.nightly),
    ],
)
def test_numbers_of_draws_tests_and_p_values_are_those_that_were_made(
    tmp_path: Path, adjust: Adjust, tests: str
) -> None:
    told = describe(read_results(record(tmp_path / "results", "all_pairs", 0, observers=6)), adjust=adjust)
    said = {one.item.code: one.text for one in told.methods.answers}
    assert told.pairs is not None
    assert told.pairs.one_scale is not None
    stability = told.pairs.estimate.stability
    assert stability is not None
    assert f"{stability.replicates:,} bootstrap samples" in said["draws"]
    assert (f"{DRAWS:,} draws for each test" in said["draws"]) == told.pairs.one_scale.by_observers
    assert ("by bootstrap over observers" in said["p_values"]) == told.pairs.one_scale.by_observers
    assert tests in said["correction"]
    assert ("after the correction" in said["p_values"]) == (adjust == "holm")
    assert re.search(r"JND \(95 %: .*\. It is \d+ %", said["effect_sizes"])


@pytest.mark.nightly
def test_without_draws_none_are_told(tmp_path: Path, report: Callable[..., Told]) -> None:
    told = report(record(tmp_path / "results", "rating"))
    assert not re.search(r"\d", told.answer("draws"))
    assert not re.search(r"\d", told.answer("correction"))
    assert re.search(r"4,000.*seed 41414", report(record(tmp_path / "more", "threshold")).answer("draws"))


def test_the_page_has_the_list() -> None:
    lines = (DOCS / "report.md").read_text(encoding="utf-8").splitlines()
    start = lines.index("| item | question | answer from | asked by |")
    rows = [line for line in lines[start + 2 : start + 2 + len(ITEMS)]]
    by = {"recorded": "the records, else `methods:`", "computed": "the computation", "given": "`methods:`"}
    assert rows == [
        f"| `{item.code}` | {item.question} | {by[item.source]} | "
        f"{', '.join(f'[{key}]' for key in item.asked_by) or 'nobody'} |"
        for item in METHODS_ITEMS
    ]
    assert not lines[start + 2 + len(ITEMS)].startswith("|")
