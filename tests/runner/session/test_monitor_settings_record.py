"""A session's record holds how the monitor was set when it was measured and when it was used."""

from __future__ import annotations

from typing import Any

from analysis.records import read_session

Study = Any  # tests/conftest.py


def test_the_header_has_both_and_the_remarks_say_what_differs(study: Study) -> None:
    study.edit("display.yaml", "    source:", "    monitor_settings: {brightness_percent: 35}\n    source:")
    with (study.folder / "rig.yaml").open("a") as rig:
        rig.write("monitor_settings: {brightness_percent: 40, local_dimming: true}\n")
    study.run()
    header = read_session(study.log_file()).header
    assert header.display.monitor_settings == {
        "measured": {"brightness_percent": 35.0},
        "used": {"brightness_percent": 40.0, "local_dimming": True},
    }
    dimming, differs = header.remarks
    assert dimming.startswith("local dimming is on")
    assert differs.endswith("brightness_percent 35, not 40")
