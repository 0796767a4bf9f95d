"""Tables of all layouts with bytes changed at random: each is read or refused by findings, in bounded time."""

from __future__ import annotations

import io
import time

import numpy as np
import pytest
from scipy.io import savemat

from analysis.comparisons import read_any
from analysis.comparisons.layouts import LAYOUTS
from analysis.errors import ResultsError

pytestmark = pytest.mark.stress
TABLES = {
    "winner-loser": "winner,loser,count,observer\n" + "a,b,2,o1\nb,a,1,o2\n" * 20,
    "pwcmp": "observer,scene,condition_A,condition_B,is_A_selected\n" + "o1,s,a,b,1\no2,s,b,c,0\n" * 20,
    "items": "observer,item_a,item_b,choice\n" + "o1,x,y,a\no2,y,z,z\no3,x,y,tie\n" * 20,
    "options": "option_1,option_2,option_3,choice\n" + "a,b,c,b\nb,c,d,3\n" * 20,
    "matrix": ",a,b,c\na,0,3,1\nb,2,0,4\nc,1,5,0\n",
    "trials": "experiment,observer,kind,first,second,answer,chosen,rejected\n"
    + "e,o1,all_pairs,x,y,x,x,y\ne,o1,all_pairs,y,z,z,z,y\ne,o2,rating,x,,3,,\n" * 20,
}
BYTES = b',\n"\r;\x00\xff0123456789ab.-e \t'


@pytest.mark.parametrize("layout", TABLES)
def test_changed_tables_are_read_or_refused(layout: str) -> None:
    assert list(TABLES) == list(LAYOUTS)
    random, whole = np.random.default_rng(len(layout)), TABLES[layout].encode()
    outcomes = [0, 0]
    for _ in range(3000):
        changed = bytearray(whole)
        for place in random.integers(len(whole), size=random.integers(1, 6)):
            changed[place] = BYTES[random.integers(len(BYTES))]
        cut = bytes(changed[: random.integers(1, len(whole)) if random.random() < 0.2 else len(whole)])
        start = time.process_time()
        try:
            told = read_any(io.BytesIO(cut), "t.csv").comparisons
        except ResultsError:
            outcomes[1] += 1
        else:
            outcomes[0] += 1
            assert np.isfinite(told.count).all()
            assert (told.count > 0).all()
            assert told.wins.diagonal().sum() == 0
        assert time.process_time() - start < 1
    assert min(outcomes) > 30  # of a matrix nearly every byte matters


def test_a_million_choices_and_a_matrix_of_a_thousand_items() -> None:
    lines = ["item_a,item_b,choice\n", *(["x,y,a\n", "y,x,x\n", "x,z,tie\n", "z,x,b\n"] * 250_000)]
    told = read_any(lines, "t.csv").comparisons
    assert (told.count.sum(), told.ties) == (750_000, 250_000)
    names = [f"n{number}" for number in range(1000)]
    rows = (f"{name},{','.join('0' if other == name else '2' for other in names)}\n" for name in names)
    told = read_any([f",{','.join(names)}\n", *rows], "t.csv").comparisons
    assert told.wins.sum() == 2 * 1000 * 999
    assert told.items == tuple(names)


def test_changed_mat_files_are_read_or_refused(tmp_path: object) -> None:
    from pathlib import Path

    file = Path(str(tmp_path)) / "t.mat"
    random = np.random.default_rng(3)
    savemat(file, {"D": np.ones((4, 4)) - np.eye(4), "C": np.array(list("abcd"), dtype=object)})
    whole, read = file.read_bytes(), 0
    for _ in range(2000):
        changed = bytearray(whole)
        for place in random.integers(len(whole), size=random.integers(1, 4)):
            changed[place] = random.integers(256)
        file.write_bytes(changed)
        try:
            read_any(file)
            read += 1
        except ResultsError:
            pass
    assert 100 < read < 1900
