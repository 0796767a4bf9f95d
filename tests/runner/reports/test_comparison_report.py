"""The comparison is reported from Python: a page, an experiment, and a typed result."""

from __future__ import annotations

from pathlib import Path

import pytest

from documents import InputError
from runner.reports import report_comparison
from stimuli.comparison import CompareOptions
from stimuli.measures import ViewingConditions
from tests.pages import policy_of
from tests.stimuli.comparison.scenes import PLATE, RIG, spots, written


@pytest.mark.usefixtures("undrawn")
def test_a_page_and_an_experiment_are_written_where_they_are_asked_for(tmp_path: Path) -> None:
    photo = written(tmp_path / "photo.exr", spots())
    options = CompareOptions(viewing=ViewingConditions.on_rig(RIG))
    page = tmp_path / "out" / "page.html"
    report = report_comparison(
        photo, photo, PLATE, options, page=page, experiment="plate", rig=RIG, root=tmp_path / "study"
    )
    assert report.validated
    assert report.page == page
    assert policy_of(page.read_text(encoding="utf-8"))
    assert report.experiment[0] == tmp_path / "study" / "experiments" / "plate.yaml"
    assert all(file.is_file() for file in report.experiment)
    record = report.to_json()
    assert record["decision"] == "validated"
    assert record["written"] == {"experiment": [str(file) for file in report.experiment], "page": str(page)}
    assert report.lines()[-1] == f"Page: {page}"


def test_nothing_is_compared_if_the_page_or_the_experiment_cannot_be(tmp_path: Path) -> None:
    photo = written(tmp_path / "photo.exr", spots())
    with pytest.raises(ValueError, match="needs a rig"):
        report_comparison(photo, photo, PLATE, experiment="plate")
    with pytest.raises(InputError, match=r"no \.html file"):
        report_comparison(photo, photo, PLATE, page=tmp_path / "page.txt")
    with pytest.raises(InputError, match="cannot be called"):
        report_comparison(photo, photo, PLATE, experiment="a b", rig=RIG)
    assert sorted(tmp_path.iterdir()) == [photo]
