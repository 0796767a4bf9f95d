"""Sessions in folders as stations leave them, and the official BIDS validator."""

from __future__ import annotations

import importlib
import importlib.util
import json
import subprocess
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from analysis.kinds import Trial
from analysis.records import FILE_NAME, Mark, Note, Resumption, new_header
from tests.answers import new_answer

STIMULI = ("one", "two", "three")
COST = {"percent_red": 0.5, "percent_any": 0.75, "delta_e_00_mean": 0.01, "delta_e_00_max": 3}
DISPLAY = {
    "file": "asus.yaml",
    "mode": "side-by-side",
    "panel": {"resolution_px": [1920, 1080], "pixel_pitch_mm": 0.2768, "refresh_hz": 120.0, "bits": 8},
    "distance_mm": 700.0,
    "glasses": "Nvidia 3D Vision",
}


@dataclass(frozen=True, slots=True)
class Lab:
    """Where stations leave their results."""

    folder: Path

    def pair(self, number: int, *, block: int = 0, trial: int | None = None, **more: Any) -> Trial:
        """One answered pair."""
        first, second = STIMULI[number % 3], STIMULI[(number + 1) % 3]
        clipping = {name: {"left": COST, "right": COST} for name in (first, second)}
        data = {
            "first": first,
            "second": second,
            "answer": "first",
            "chosen": first,
            "rejected": second,
            "first_position": "top",
            "clipping": clipping,
        }
        utc = f"2026-01-02T03:{4 + number // 60:02d}:{number % 60:02d}.250+00:00"
        attempt = more.pop("attempt", 0)
        place = block, number if trial is None else trial
        return new_answer(*place, "all_pairs", (("up", 1.25),), 1.25, utc, {**data, **more}, attempt)

    def trial(self, kind: str, data: Mapping[str, Any], *, block: int = 0, trial: int = 0) -> Trial:
        """A trial of any kind."""
        return new_answer(block, trial, kind, (("space", 0.5),), 0.5, "2026-01-02T03:04:06.000+00:00", data)

    def session(
        self,
        records: Sequence[Trial | Note | Mark | Resumption] | None = None,
        *,
        observer: str = "01",
        session: str = "20260102T030405abcd",
        station: str = "results",
        complete: bool = True,
        recorded_on: str = "",
        **header: Any,
    ) -> Path:
        """Leave a session and return its file."""
        values: dict[str, Any] = {
            "experiment": "dynamic_range",
            "observer": observer,
            "session": session,
            "started_utc": "2026-01-02T03:04:00+00:00",
            "seed": 7,
            "question": "Which is closer?",
            "simulated": True,
            "stimuli": tuple(
                {"name": name, "factors": {"view": "stereo"}, "clipping": {"left": COST, "right": COST}}
                for name in STIMULI
            ),
            "display": DISPLAY,
            "analysis": {"alpha": 0.05, "adjust": "holm"},
            "hashes": {"experiment": "ab" * 32},
            "software": {"cyclopean": "0.1.0", "system": "Linux"},
            "presentation": {"renderer": "llvmpipe"},
        }
        lines = [new_header(**values, station=recorded_on).to_json() | header] + [
            record.to_json() for record in (records if records is not None else [self.pair(n) for n in range(3)])
        ]
        if complete:
            lines.append({"record": "end"})
        file = self.folder / station / "dynamic_range" / f"sub-{observer}" / f"ses-{session}" / FILE_NAME
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text("".join(json.dumps(line) + "\n" for line in lines), encoding="utf-8")
        return file


@pytest.fixture
def lab(tmp_path: Path) -> Lab:
    return Lab(tmp_path)


@pytest.fixture(scope="session")
def bids_issues() -> Callable[[Path], list[dict[str, Any]]]:
    """Run the official BIDS validator on a folder, every row of every table, and return what it says.

    It is given no network: the schema is the one that comes with it.
    """
    found = importlib.util.find_spec("bids_validator_deno")
    if found is None or found.origin is None:
        pytest.skip("the BIDS validator is not installed (package bids-validator-deno)")
    program = Path(found.origin).parent / "bids-validator.js"
    command = [
        str(importlib.import_module("deno").find_deno_bin()),
        "run",
        "--no-prompt",
        "--allow-read",
        "--allow-env",
        str(program),
    ]

    def issues(folder: Path) -> list[dict[str, Any]]:
        told = subprocess.run(
            [*command, "--format", "json", "--max-rows", "-1", str(folder)], capture_output=True, text=True, timeout=300
        )
        assert told.returncode in (0, 16), told.stderr  # 16: there are errors
        said = json.loads(told.stdout)
        assert said["summary"]["totalFiles"] > 0
        return list(said["issues"]["issues"])

    return issues
