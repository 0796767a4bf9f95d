"""Why a picture cannot be opened."""

from __future__ import annotations

from pathlib import Path

import pytest

from stimuli.errors import StimulusError
from stimuli.pictures.picture_input import opened, reason


def test_a_file_that_is_no_picture_is_named_with_the_reason_and_the_remedy(tmp_path: Path) -> None:
    (tmp_path / "a.exr").write_bytes(b"no picture")
    with pytest.raises(StimulusError, match="cannot be read") as caught, opened(tmp_path / "a.exr", "write it again"):
        pass
    (finding,) = caught.value.findings
    assert finding.file == str(tmp_path / "a.exr")
    assert finding.remedy == "write it again"
    assert "no reason given" not in finding.message


@pytest.mark.parametrize(
    ("message", "told"),
    [
        ("first\nsecond\n", "second"),
        ("the size is absurd\nIf that is right, raise the OIIO global attribute 'limits'.", "the size is absurd"),
        ("only a global attribute", "only a global attribute"),
        (" \n", "no reason given"),
    ],
)
def test_the_reason_is_no_advice_on_settings(message: str, told: str) -> None:
    assert reason(message) == told
