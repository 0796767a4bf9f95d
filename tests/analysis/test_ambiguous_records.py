"""Records that can be read in two ways are read in the way that agrees with them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from analysis.errors import ResultsError
from analysis.kinds import Trial
from analysis.records import SessionLog, new_header, read_session
from tests.answers import new_answer

NAMES = ("a", "b", "c")
UTC = "2026-01-31T09:30:00.000+00:00"
HEADER = new_header("views", "01", "s1", UTC, simulated=True, stimuli=[{"name": name} for name in NAMES])


def read(folder: Path, *trials: Trial) -> SessionLog:
    file = folder / "session.jsonl"
    lines = [HEADER.to_json(), *(trial.to_json() for trial in trials)]
    file.write_text("".join(json.dumps(line) + "\n" for line in lines), encoding="utf-8")
    return read_session(file)


def best(number: int, keys: tuple[str, ...], chosen: int) -> Trial:
    """Return a choice after a page that took as long as each step of the path."""
    path = [[index, 0.5] for index in range(chosen + 1)]
    data = {
        "series": "one",
        "stimuli": list(NAMES),
        "start": 0,
        "chosen": NAMES[chosen],
        "chosen_index": chosen,
        "path": path,
        "dwell_s": [0.5 if index <= chosen else 0.0 for index in range(3)],
        "ratings": {},
        "rating_times_s": {},
    }
    events = tuple((key, 0.5) for key in keys)
    utc = f"2026-01-31T09:3{number + 1}:00.000+00:00"
    return new_answer(0, number, "best_of_series", events, 0.5 * (chosen + 1), utc, data)


def test_presses_of_a_page_before_may_have_the_times_of_the_path(tmp_path: Path) -> None:
    log = read(tmp_path, best(0, ("space", "right", "space"), 1), best(1, ("right", "right", "enter", "7"), 2))
    assert [trial.details()["chosen"] for trial in log.trials] == ["b", "c"]


def test_presses_that_do_not_lead_along_the_path_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ResultsError, match="the key 'left' means 'previous'"):
        read(tmp_path, best(0, ("left", "space"), 1))


def test_either_of_two_pictures_may_be_the_stereo_one(tmp_path: Path) -> None:
    def preferred(number: int, first: str, second: str) -> Trial:
        data = {"first": first, "second": second, "answer": "first", "chosen": first, "rejected": second}
        data |= {"chosen_view": "stereo", "first_view": "stereo"}
        utc = f"2026-01-31T09:3{number + 1}:00.000+00:00"
        return new_answer(0, number, "preference", (("1", 0.8),), 0.8, utc, data)

    log = read(tmp_path, preferred(0, "a", "b"), preferred(1, "b", "a"))
    assert [trial.details()["chosen"] for trial in log.trials] == ["a", "b"]


@pytest.mark.parametrize("digits", [100, 4000, 5000])
def test_a_whole_number_of_thousands_of_digits_is_refused_with_its_line(tmp_path: Path, digits: int) -> None:
    """Also where no field of this version has it: a report would print it."""
    file = tmp_path / "session.jsonl"
    trial = json.dumps(best(0, ("right", "space"), 1).to_json())
    file.write_text(json.dumps(HEADER.to_json()) + "\n" + trial[:-1] + ', "later": 1' + "0" * digits + "}\n")
    with pytest.raises(ResultsError) as refused:
        read_session(file)
    assert refused.value.findings[0].line == 2
