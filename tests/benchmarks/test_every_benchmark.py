"""Every benchmark runs to its end, small, and what is exact of its promises is kept and as in the last release."""

from __future__ import annotations

import json
import runpy
import shutil
from pathlib import Path

import pytest

from benchmarks import history
from benchmarks.history import Promise
from benchmarks.run_all import HERE, scripts

pytestmark = pytest.mark.nightly

MISSING = {"trial_switch": "xvfb-run", "work": "xvfb-run"}


@pytest.mark.filterwarnings("ignore")  # peers warn as they like
@pytest.mark.parametrize("script", scripts())
def test_a_quick_run_ends_with_its_exact_promises_kept(
    script: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if script in MISSING and shutil.which(MISSING[script]) is None:
        pytest.skip(f"needs {MISSING[script]}")
    monkeypatch.syspath_prepend(str(HERE))
    monkeypatch.setattr("sys.argv", [f"{script}.py", "--quick", f"--out={tmp_path}"])
    runpy.run_path(str(HERE / f"{script}.py"), run_name="__main__")
    said = json.loads((tmp_path / f"{script}.json").read_text(encoding="utf-8"))
    assert said["quick"]
    assert said["rows"]
    promises = {history.key(script, one): one for one in map(Promise.from_json, said["promises"])}
    broken = [one.words(quick=True) for one in promises.values() if one.state(quick=True) == "NOT KEPT"]
    assert not broken
    last = history.releases()[-1:]
    assert not [change for line in last for change in history.fallen(promises, line, quick=True)]
