"""What an export to BIDS costs, beside the least that any export does: to read the logs and to write their lines."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

from curves import program, seconds, sized
from promises import Promise

from analysis.kinds import new_trial
from analysis.records import FILE_NAME, new_header, read_session, session_files
from extensions.bids.export import export_dataset

STIMULI = tuple(f"s{index}" for index in range(10))
COST = {f"percent_{what}": 0.5 for what in ("red", "green", "blue", "any", "above_full")} | {"delta_e_00_mean": 0.1}


def _leave(folder: Path, sessions: int, trials: int) -> None:
    """Write sessions of pairs as the runner does."""
    started = "2026-01-02T03:00:00+00:00"
    for number in range(sessions):
        label = f"o{number}"
        described = tuple({"name": name, "factors": {}} for name in STIMULI)
        header = new_header("bench", label, f"s{number}", started, question="Which?", simulated=True, stimuli=described)
        file = folder / f"sub-{label}" / FILE_NAME
        file.parent.mkdir(parents=True)
        with open(file, "w", encoding="utf-8") as stream:
            stream.write(json.dumps(header.to_json()) + "\n")
            for trial in range(trials):
                first, second = STIMULI[trial % 10], STIMULI[(trial + 3) % 10]
                clipping = {name: {"left": COST, "right": COST} for name in (first, second)}
                data = {"first": first, "second": second, "answer": "first", "chosen": first, "rejected": second}
                data |= {"clipping": clipping}
                answer = new_trial(0, trial, "all_pairs", (("up", 1.0),), 1.0, "2026-01-02T03:00:01.000+00:00", data)
                stream.write(json.dumps(answer.to_json()) + "\n")


def _write_again(results: Path, file: Path) -> None:
    with open(file, "w", encoding="utf-8") as stream:
        for log in map(read_session, session_files(results)):
            stream.writelines(json.dumps(trial.to_json()) + "\n" for trial in log.trials)


def run(sessions: int = sized(100, 3), trials: int = 45) -> dict[str, object]:
    """Time both; the error column has no meaning here."""
    with tempfile.TemporaryDirectory() as place:
        results = Path(place, "results")
        _leave(results, sessions, trials)
        exporting = seconds(lambda: export_dataset([results], Path(place, "bids")), repeats=3)
        reading = seconds(lambda: [len(read_session(file).trials) for file in session_files(results)], repeats=3)
        again = seconds(lambda: _write_again(results, Path(place, "again.jsonl")), repeats=3)
    what = f"{sessions} sessions of {trials} trials"
    rows = [
        {"series": "export", "parameter": what, "seconds": exporting, "error": None},
        {"series": "reading the logs", "parameter": what, "seconds": reading, "error": None},
        {"series": "reading them and writing their lines", "parameter": what, "seconds": again, "error": None},
    ]
    rows[0]["note"] = f"{1000 * exporting / sessions:.1f} ms per session, {exporting / reading:.1f} × reading the logs"
    promise = Promise(
        "time beside reading the logs and writing their lines", exporting / again, 5.0, "ratio", "at most", "×"
    )
    return {"title": "BIDS export", "rows": rows, "promises": [promise]}


if __name__ == "__main__":
    program("bids_export", run)
