"""When compiled loops do the work, and that what was compiled from old constants is compiled again."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from documents import compiled
from documents.compiled import loops, without_compiled_loops
from tests.compiled_loops import compiled_if_there

LOOPS = "devices.colour.ciede2000_loops"
# A package of its own: a constant in one file, a loop in another.
_LOOP = """
from documents.compiled import loop
from shop.price import PRICE

@loop("int64(int64)")
def cost(pieces):
    return pieces * PRICE
"""


def test_small_pictures_and_those_who_forbid_it_are_left_to_numpy() -> None:
    assert loops(LOOPS, 1000) is None
    with compiled_if_there(), without_compiled_loops():
        assert loops(LOOPS, 1000) is None


def test_without_numba_or_with_one_that_does_not_go_with_numpy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "numba", None)
    compiled._numba.cache_clear()
    try:
        assert (loops(LOOPS, 10**9), compiled.compiler(10**9)) == (None, None)
    finally:
        compiled._numba.cache_clear()


def test_what_was_compiled_is_kept_until_a_file_of_its_folder_changes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("numba")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    shop = tmp_path / "shop"
    shop.mkdir()
    (shop / "__init__.py").touch()
    (shop / "shop_loops.py").write_text(_LOOP, encoding="utf-8")

    def asked(price: int, time: int) -> int:
        (shop / "price.py").write_text(f"PRICE = {price}", encoding="utf-8")
        os.utime(shop / "price.py", (time, time))
        for name in [name for name in sys.modules if name.partition(".")[0] == "shop"]:
            monkeypatch.delitem(sys.modules, name)  # as in another process
        module = loops("shop.shop_loops", 10**9)
        assert module is not None
        return int(module.cost(3))

    assert asked(2, 1_000_000_000) == 6
    kept = list(shop.rglob("*.nbc"))
    assert len(kept) == 1
    before = kept[0].stat().st_mtime_ns
    assert asked(2, 1_000_000_000) == 6
    assert kept[0].stat().st_mtime_ns == before
    # Numba by itself would go on with the old price.
    assert asked(5, 4_000_000_000) == 15
