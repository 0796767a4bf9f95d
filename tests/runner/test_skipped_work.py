"""What the shipped experiments read, decode, upload, shade, draw and compute, counted: no more than they need.

Pictures are small, 43 x 29 pixels of three floats; all else is as shipped. A change that does needless work, such as a
second upload of a flat picture, a cost computed again or a picture read for nothing, changes a count. One that does
less work changes it too: write the new count here.
"""

from __future__ import annotations

import json
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from documents import count_work, counted_work
from stimuli.build import stimulus_set
from stimuli.pictures import read_exr
from tests.invoked import printed_json
from tests.runner.cli.sessions import write_session
from tests.runner.test_shipped_experiments import SMALL_PIXELS, copied

BYTES = 12 * SMALL_PIXELS


@dataclass(frozen=True, slots=True)
class Needed:
    """What a session of an experiment needs."""

    law: str
    recipe: str
    flat: int
    stereo: int
    frames: int
    texts: int

    @property
    def pictures(self) -> int:
        return self.flat + self.stereo

    @property
    def drawn(self) -> dict[str, int]:
        """The presenter's counters: each view of each picture once, and each page once."""
        views = self.flat + 2 * self.stereo
        return {
            "decodes": self.pictures,
            "uploads": views,
            "bytes_uploaded": views * BYTES,
            "colour_passes": views,
            "pixels_shaded": views * SMALL_PIXELS,
            "texts_rasterised": self.texts,
            "frames_drawn": self.frames,
            "frames_redrawn": 0,
            "scenes_skipped": 0,
            "frames_alternated": 0,
            "frames_missed": 0,
            "pointers_drawn": 0,
            "evictions": 0,
            "gamma_table_reads": 1,
        }


NEEDED = {
    # 45 pairs, a page, two breaks
    "dynamic_range": Needed("table_4_4", "manitoba_gray", flat=5, stereo=5, frames=48, texts=6),
    # 12 pairs in turn, each of two pictures with blanks between, a page
    "preliminary": Needed("preliminary", "preliminary", flat=6, stereo=6, frames=61, texts=9),
    # 30 pairs, a page, a break
    "paints": Needed("paints", "paints", flat=0, stereo=20, frames=32, texts=5),
}


@pytest.fixture
def read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Counter[str]:
    """Built pictures that are read, by name; the cache is the test's own."""
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / "cache"))
    names: Counter[str] = Counter()

    def counted(path: Path, **options: Any) -> Any:
        names[path.stem] += 1
        return read_exr(path, **options)

    monkeypatch.setattr(stimulus_set, "read_exr", counted)
    return names


def _json(*words: object) -> dict[str, Any]:
    """Return what a command prints as JSON, of the first file."""
    found = printed_json(*words)
    return dict(found[0] if isinstance(found, list) else found)


@pytest.mark.promise("no-needless-work")
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[] if name == "preliminary" else pytest.mark.nightly) for name in NEEDED]
)
def test_a_shipped_experiment_does_what_it_needs_and_nothing_twice(
    tmp_path: Path, read: Counter[str], name: str
) -> None:
    needed, file, results = NEEDED[name], copied(tmp_path, name, small=True), tmp_path / "results"
    law = tmp_path / f"configs/observers/{needed.law}.yaml"

    def session(observer: str) -> dict[str, int]:
        read.clear()
        done = _json("run", file, "--observer", observer, "--simulate", law, "--results", results)
        work: dict[str, int] = done["work"]
        return work

    # First all is made: each picture once, each cost once.
    costs = {"clipping_costs_computed": needed.pictures, "clipping_costs_cached": 0}
    assert session("01") == {"pictures_rendered": needed.pictures, **needed.drawn, **costs}
    # Once for its cost and once to be shown, at most; some are still in memory then.
    assert len(read) == needed.pictures
    assert max(read.values()) <= 2
    # Again, nothing is made, and each picture is read once, to be shown.
    costs = {"clipping_costs_computed": 0, "clipping_costs_cached": needed.pictures}
    assert session("02") == {"pictures_rendered": 0, **needed.drawn, **costs}
    assert len(read) == needed.pictures
    assert set(read.values()) == {1}
    # A check afterwards and a build read no picture at all.
    read.clear()
    check = _json("check", file, "--no-screen", "--results", results)
    assert {key: check[key] for key in ("pictures_rendered", *costs)} == {"pictures_rendered": 0, **costs}
    rig = tmp_path / "configs/rigs/asus_vg248qe_3dvision.yaml"
    assert _json("check", rig, "--no-screen")["kind"] == "rig"
    assert not read
    recipe = tmp_path / f"configs/stimuli/{needed.recipe}.yaml"
    assert _json("stimuli", "build", recipe, "--rig", rig)["rendered"] == 0


def test_the_log_counts_what_the_command_prints(tmp_path: Path, read: Counter[str]) -> None:
    file = copied(tmp_path, "preliminary", small=True)
    law = tmp_path / "configs/observers/preliminary.yaml"
    done = _json("run", file, "--observer", "01", "--simulate", law, "--results", tmp_path / "results")
    lines = (Path(done["folder"]) / "session.jsonl").read_text(encoding="utf-8").splitlines()
    (logged,) = [record["work"] for record in map(json.loads, lines) if "work" in record]
    assert done["work"] == {"pictures_rendered": 12, **logged}


# What reports and scores read, fit and draw, counted: no more than they need.


def test_work_is_counted_in_all_threads_and_in_every_count_that_is_open() -> None:
    count_work("pictures_read")  # nobody counts
    with counted_work() as whole:
        with counted_work() as part, ThreadPoolExecutor(4) as pool:
            list(pool.map(lambda _: count_work("pictures_read"), range(100)))
        count_work("pictures_read", 2)
    count_work("pictures_read")
    assert (dict(part), dict(whole)) == ({"pictures_read": 100}, {"pictures_read": 102})


@pytest.mark.promise("no-needless-work")
def test_a_report_reads_each_session_once_and_fits_no_model_twice(tmp_path: Path) -> None:
    for number in range(4):
        write_session(tmp_path / "results", f"{number:02d}")
    found = _json("report", tmp_path / "results", "-o", tmp_path / "report.html")["work"]
    # Which pairs differ is decided by bounds, for most of the 1000 bootstraps and 180 studies; the others are climbed.
    bounded, climbed = found.pop("profiles_bounded"), found.pop("profiles_climbed")
    assert 0 < 2 * climbed < bounded
    # One fit, 1000 bootstraps of it, and those with each observer left out, with other models and for each test; 199 of
    # studies simulated for the smallest difference, and 12 of the answers analysed in other ways; 6 are penalised.
    # Intervals of six pairs, of three neighbours and of one effect in two ways.
    draws = {"bootstrap_draws": 1000, "models_fitted": 1049 + 199 + 12 + 6, "classes_found": 1}
    assert found == {"sessions_read": 4, "trials_read": 48, "figures_drawn": 8, "profile_intervals": 11, **draws}


def test_scores_fit_one_model_and_one_for_the_tests_of_two_items(tmp_path: Path) -> None:
    table = tmp_path / "table.csv"
    table.write_text("winner,loser,count\n" + "".join(f"{a},{b},3\n" for a in "abc" for b in "abc" if a != b))
    assert _json("scores", table)["work"] == {"models_fitted": 2, "classes_found": 1, "profile_intervals": 2}
