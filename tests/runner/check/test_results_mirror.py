"""`check` names the folder that results are copied to, and warns where it is not."""

from __future__ import annotations

import json
from typing import Any

Study = Any  # tests/conftest.py


def test_a_folder_that_is_not_there_is_a_warning(study: Study) -> None:
    study.edit("rig.yaml", "distance_mm: 700", "distance_mm: 700\nresults_mirror: backup")
    for there in (False, True):
        if there:
            (study.folder / "backup").mkdir()
        (facts,) = json.loads(study.cyclopean("check", study.folder / "rig.yaml", "--json").stdout)
        assert facts["results_mirror"] == str(study.folder / "backup")
        warned = [finding for finding in facts["warnings"] if "results_mirror" in finding["message"]]
        assert len(warned) == (not there)
