"""MAT-files: what SciPy writes is read as SciPy reads it, and what a file only announces is not believed."""

from __future__ import annotations

import io
import time
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from devices.measurements import MatFileError, read_mat
from tests.stress.foreign_formats import FORMATS

RNG = np.random.default_rng(1)
NUMBERS = {
    "double": np.array([[380.0, 5.0, 81.0]]),
    "single": RNG.random((3, 4, 2)).astype(np.float32),
    **{
        f"{sign}int{bits}": RNG.integers(0, 100, (2, 3)).astype(f"{sign}int{bits}")
        for sign in ("", "u")
        for bits in (8, 16, 32, 64)
    },
    "truth": np.array([[True, False]]),
}


def _row(*values: object) -> np.ndarray:
    row = np.empty((1, len(values)), dtype=object)
    row[0, :] = values
    return row


def _saved(compressed: bool, **variables: object) -> bytes:
    stream = io.BytesIO()
    savemat(stream, variables, do_compression=compressed)  # type: ignore[arg-type]  # a stream is right too
    return stream.getvalue()


@pytest.mark.parametrize("compressed", [False, True])
def test_what_scipy_writes_is_read(compressed: bool) -> None:
    others = {"text": "a display äö€", "empty": np.zeros((0, 0)), "complex": np.array([[1 + 2j]])}
    inner = {**NUMBERS, **others, "cell": _row("x", np.eye(2)), "struct": {"deep": {"x": 3.0}}}
    data = _saved(compressed, other=np.zeros((100, 100)), cals=_row(inner, {"x": 1.0}))
    read: Any = read_mat(data, "cals", "cal")
    assert set(read) == {"cals"}
    (first,), (second,) = read["cals"]
    for name, values in NUMBERS.items():
        np.testing.assert_array_equal(first[name], values)
    assert first["text"] == others["text"]
    assert first["empty"].size == 0
    assert first["complex"] is None
    assert first["cell"][0] == "x"
    np.testing.assert_array_equal(first["cell"][1], np.eye(2))
    assert first["struct"][0]["deep"][0]["x"].tolist() == [[3.0]]
    assert second["x"].tolist() == [[1.0]]


@pytest.mark.nightly
def test_large_variables_that_are_not_wanted_are_not_unpacked() -> None:
    data = _saved(True, pictures=np.zeros(8_000_000), cal={"x": 1.0})
    assert list(read_mat(data, "cal")) == ["cal"]
    with pytest.raises(MatFileError, match="unpacks to more than 50 MB"):
        read_mat(data, "pictures")


@pytest.mark.parametrize(
    ("name", "why"),
    [
        pytest.param("a bomb", "unpacks to more than|a part states", marks=pytest.mark.nightly),
        pytest.param("a hundred bombs", "more than 20000000 numbers", marks=pytest.mark.nightly),
        pytest.param("structs", "values in one variable", marks=pytest.mark.nightly),
        ("too many cells", "values in one variable"),
        ("nested", "in each other"),
        ("variables", "more than 10000 variables"),
        ("negative", "has the dimensions -1 by -1"),
        ("version 7.3", "version 7.3"),
        ("version 4", "no MAT-file of version 5"),
        ("nothing", "no MAT-file of version 5"),
    ],
)
def test_what_a_file_only_announces_is_not_believed(name: str, why: str) -> None:
    (mat,) = (form for form in FORMATS if form.name == "mat")
    data = mat.crafted()[name]
    began_s = time.process_time()
    with pytest.raises(MatFileError, match=why):
        read_mat(data, "cals")
    assert time.process_time() - began_s < 5
