"""What proves an extension: our own kinds of block keep the promises, and kinds that break one are found out."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from analysis.kinds import KINDS, new_trial
from analysis.records import SessionLog, new_header, read_session, session_files
from analysis.report import PARTS, describe
from cyclopean.testing import prove_block
from documents import InputError
from tests.runner.every_kind import VARIANTS, written

ROOT = Path(__file__).parents[2]
PACKAGE = "same_or_different"
POINTS = {
    "blocks": f"{PACKAGE}.block:SameOrDifferent",
    "records": f"{PACKAGE}.record:SameOrDifferentRecord",
    "report_parts": f"{PACKAGE}.report:part",
}
# What is changed in the example's block, and the promise that is said to be broken; as it is, none is.
CASES = {
    "as it is": ("", "", "kept"),
    "shows another": ("view.interval(number, name)", "view.interval(number, other)", "names what was shown"),
    "no part": ("return float(2", "return 1 / 0 + float(2", "part of the report is made"),
    "no seed": ('random.Random(f"{setting.own_seed}/same_or_different")', "random.Random()", "equal sessions"),
    "by the process": ("second = first if", "second = other if next(_shown) > 60 else first if", "where it stopped"),
}
MARKS = dict.fromkeys(CASES.keys() - {"shows another"}, pytest.mark.nightly)
PROOF = """
import sys
from cyclopean.testing import BrokenPromiseError, prove_block
try:
    proof = prove_block("kind: same_or_different, trials: 4, exposure_s: 0.1", sys.argv[1])
    assert proof.trials == 6 and proof.cut > 10 and "Same or different" in proof.report.read_text(encoding="utf-8")
    print("kept")
except BrokenPromiseError as error:
    print(error)
"""


@pytest.mark.parametrize(
    ("kind", "variant"),
    [pytest.param(*one, marks=[] if one == ("all_pairs", 1) else pytest.mark.nightly) for one in VARIANTS],
)
def test_our_kinds_keep_the_promises(kind: str, variant: int, tmp_path: Path) -> None:
    proof = prove_block(written(kind, variant), tmp_path)
    assert proof.trials >= 3
    assert proof.cut >= 5
    assert proof.report.is_file()


@pytest.mark.parametrize("case", [pytest.param(case, marks=MARKS.get(case, ())) for case in CASES])
def test_a_broken_promise_is_found_in_another_package(case: str, tmp_path: Path) -> None:
    old, new, said = CASES[case]
    _install(tmp_path / "site", old, new)
    (tmp_path / "proof").mkdir()
    assert said in _run(tmp_path, "-c", PROOF, str(tmp_path / "proof")).stdout


@pytest.mark.extensions
def test_what_a_package_adds_is_listed_recorded_and_missed(tmp_path: Path) -> None:
    _install(tmp_path / "site")
    (tmp_path / "proof").mkdir()
    assert "cyclopean-same-or-different 1.0" in _run(tmp_path, "-m", "cyclopean", "--version").stdout
    listed = json.loads(_run(tmp_path, "-m", "cyclopean", "doctor", "--json").stdout)["extensions"]
    assert listed == {"cyclopean-same-or-different 1.0": [f"{PACKAGE} ({group})" for group in POINTS]}
    assert _run(tmp_path, "-c", PROOF, str(tmp_path / "proof")).stdout == "kept\n"
    (log,) = session_files(tmp_path / "proof/whole")
    header = json.loads(log.read_text(encoding="utf-8").splitlines()[0])
    assert header["extensions"] == {PACKAGE: "cyclopean-same-or-different"}
    assert header["software"]["cyclopean-same-or-different"] == "1.0"
    with pytest.raises(InputError) as refused:
        read_session(log)
    assert "pip install cyclopean-same-or-different" in (refused.value.findings[0].remedy or "")


def _run(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """Run Python with the package of ``folder`` beside ours."""
    paths = {"PYTHONPATH": f"{folder / 'site'}{os.pathsep}{ROOT}", "XDG_CACHE_HOME": str(folder / "cache")}
    command = [sys.executable, *words]
    return subprocess.run(command, env={**os.environ, **paths}, stdout=subprocess.PIPE, text=True, check=True)


def _install(site: Path, old: str = "", new: str = "") -> None:
    """Lay the example's package beside Python's own, as `pip install` would, with ``new`` in place of ``old``."""
    facts = site / "cyclopean_same_or_different-1.0.dist-info"
    facts.mkdir(parents=True)
    (facts / "METADATA").write_text("Metadata-Version: 2.1\nName: cyclopean-same-or-different\nVersion: 1.0\n")
    lines = [f"[cyclopean.{group}]\n{PACKAGE} = {target}\n" for group, target in POINTS.items()]
    (facts / "entry_points.txt").write_text("".join(lines))
    (site / PACKAGE).mkdir()
    for file in (ROOT / "examples/extension" / PACKAGE).glob("*.py"):
        text = file.read_text(encoding="utf-8")
        text = text.replace(old, new) + (
            "import itertools\n\n_shown = itertools.count()\n" if file.stem == "block" else ""
        )
        (site / PACKAGE / file.name).write_text(text, encoding="utf-8")


@pytest.mark.parametrize("key", ["", "notes", "ratings", "goodness_of_fit"])
def test_a_part_that_cannot_be_made_or_hides_another_result_costs_the_report_nothing_else(
    key: str, install: Callable[..., None], monkeypatch: pytest.MonkeyPatch
) -> None:
    pair = ({"name": "a"}, {"name": "b"})
    header = new_header("views", "01", "s1", "2026-01-31T09:30:00Z", seed=1, stimuli=pair)
    answer = {"first": "a", "second": "b", "answer": "first", "chosen": "a", "rejected": "b"}
    trial = new_trial(0, 0, "all_pairs", (), 1.2, "2026-01-31T09:31:00Z", answer)
    log = SessionLog(Path("session.jsonl"), header, (trial,), complete=True)
    made = f"from analysis.report import Part\n    return Part({key!r})" if key else "raise OSError"
    package = f"torn_{key}"
    install(
        package, f"CYCLOPEAN_INTERFACE = 1\ndef part(sessions):\n    {made}", group=PARTS.group, **{package: "part"}
    )
    monkeypatch.setattr(KINDS["all_pairs"], "report_part", package)
    found = describe([log])
    assert found.pairs is not None
    assert [f"{package} 1.0" in check.reason for check in found.failed if package in check.check] == [True]
