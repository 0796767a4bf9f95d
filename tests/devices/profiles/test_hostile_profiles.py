"""Damaged profiles: whatever bytes are cut off or changed, the answer is a reading or a refusal, and comes soon."""

from __future__ import annotations

import time
from contextlib import suppress
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.characterise import thesis_display
from devices.errors import DeviceError
from devices.profiles import model_of_profile, profile_of_model
from devices.profiles.profile import profile_of
from devices.profiles.tag_table import parse_profile_file
from devices.readings import Measurements, profile_measurements
from devices.readings.ti3 import format_ti3
from tests.devices.profiles.profile_bytes import curv, matrix_tags, para, profile, text, vcgt
from tests.devices.profiles.test_colour_table import TABLES


@cache
def whole_profiles() -> dict[str, bytes]:
    readings = Measurements(np.eye(3), np.eye(3) * 50 + 1)
    table = {"vcgt": vcgt(3, 2, [0, 30000, 65535] * 3)}
    return {
        "matrix": profile(matrix_tags(para(3, 2.4, 0.948, 0.052, 0.0774, 0.04)) | table),
        "sampled": profile(matrix_tags(curv(*range(0, 65536, 1057))), version=2),
        "mft2": profile(matrix_tags(curv()) | {"A2B0": TABLES["16 bits"]}, pcs=b"Lab ", version=2),
        "mAB": profile(matrix_tags(curv()) | {"A2B1": TABLES["mAB"]}),
        "readings": profile({"targ": text(format_ti3(readings))} | table, version=2),
        "own": profile_of_model(thesis_display(), "own").data,
    }


def _read(data: bytes) -> None:
    """Read ``data`` every way; fail unless each gives finite light or refuses with a DeviceError."""
    with suppress(DeviceError):
        made = profile_of(parse_profile_file(data, "display.icc"))
        with suppress(DeviceError):
            assert np.all(np.isfinite(profile_measurements(made, 100.0).XYZ))
        assert np.all(np.isfinite(model_of_profile(made, 100.0).model.xyz(np.eye(3))))


@settings(max_examples=15, deadline=None)
@given(st.sampled_from(sorted(whole_profiles())), st.data())
def test_changed_bytes_give_a_reading_or_a_refusal(name: str, data: st.DataObject) -> None:
    whole = bytearray(whole_profiles()[name])
    # Most of what matters stands in the first kilobyte: header, tag table, heads of tags.
    places = st.one_of(st.integers(0, min(1000, len(whole) - 1)), st.integers(0, len(whole) - 1))
    for place, value in data.draw(st.lists(st.tuples(places, st.integers(0, 255)), min_size=1, max_size=6)):
        whole[place] = value
    _read(bytes(whole))


@settings(max_examples=15, deadline=None)
@given(st.sampled_from(sorted(whole_profiles())), st.data())
def test_a_profile_cut_off_is_refused(name: str, data: st.DataObject) -> None:
    whole = whole_profiles()[name]
    cut = whole[: data.draw(st.integers(0, len(whole) - 1))]
    with pytest.raises(DeviceError):
        parse_profile_file(cut, "display.icc")
    # Though its header say that it is whole.
    if len(cut) > 4:
        _read(len(cut).to_bytes(4) + cut[4:])


def test_tables_that_only_announce_their_size_take_no_time_and_no_memory(tmp_path: Path) -> None:
    began = time.process_time()
    for tag in (b"mft2\0\0\0\0\x03\x03\xff\0" + b"\xff" * 60, b"curv\0\0\0\0\xff\xff\xff\xff", b"mAB " + b"\xff" * 40):
        for name in ("A2B0", "rTRC", "vcgt", "chad", "lumi"):
            _read(profile(matrix_tags(curv()) | {name: tag}))
    assert time.process_time() - began < 2.0


def test_tags_may_share_their_bytes() -> None:
    data = bytearray(whole_profiles()["sampled"])
    count = int.from_bytes(data[128:132])
    entries = {bytes(data[at : at + 4]): at for at in range(132, 132 + 12 * count, 12)}
    data[entries[b"gTRC"] + 4 : entries[b"gTRC"] + 12] = data[entries[b"rTRC"] + 4 : entries[b"rTRC"] + 12]
    model = model_of_profile(profile_of(parse_profile_file(bytes(data), "display.icc"))).model
    assert model.curves[0] == model.curves[1]
