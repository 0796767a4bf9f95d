"""The bits that codes have: what the driver is asked, and what follows from its answer."""

from __future__ import annotations

import ctypes
from typing import Any

import pytest

from runner.presenter import PresentationError
from runner.presenter.depth import Bits, given_bits, highest_code
from runner.presenter.surfaces import gl_calls
from runner.presenter.surfaces.gl_calls import GlCalls
from runner.presenter.surfaces.glfw_session import context_hints


@pytest.mark.parametrize(("bits", "highest"), [(8, 255), (10, 1023)])
def test_the_highest_code(bits: Bits, highest: int) -> None:
    assert highest_code(bits) == highest


@pytest.mark.parametrize(
    ("asked", "found", "given", "said"),
    [
        (8, 8, 8, None),
        (10, 10, 10, None),
        (10, 8, 8, "10 bits a channel were asked for, and the driver gives 8: codes have 8 bits"),
        (8, 10, 8, "codes have 8 bits, on a framebuffer of 10 bits a channel"),
        (8, 0, 8, "the driver does not report how many bits its framebuffer has: codes have 8"),
        (10, 0, 8, "the driver does not report how many bits its framebuffer has: codes have 8"),
        (10, 16, 10, "codes have 10 bits, on a framebuffer of 16 bits a channel"),
    ],
)
def test_a_depth_other_than_asked_is_never_silent(asked: Bits, found: int, given: Bits, said: str | None) -> None:
    assert given_bits(asked, found) == (given, (said,) if said else ())


@pytest.mark.parametrize("asked", [8, 10])
@pytest.mark.parametrize("found", [5, 6])
def test_fewer_than_eight_bits_are_refused(asked: Bits, found: int) -> None:
    with pytest.raises(PresentationError, match=f"a framebuffer of {found} bits a channel"):
        given_bits(asked, found)


def test_the_driver_is_asked_for_the_size_of_each_channel() -> None:
    """A framebuffer is as deep as its shallowest channel: 5, 6 and 5 bits are 5."""
    asked: list[tuple[int, int, int]] = []
    sizes = {0x8212: 5, 0x8213: 6, 0x8214: 5}
    kept: list[Any] = []

    def load(name: str) -> int:
        signature: Any = ctypes.CFUNCTYPE(None, *(ctypes.c_uint,) * 3, ctypes.POINTER(ctypes.c_int))

        def answer(target: int, attachment: int, parameter: int, value: Any) -> None:
            asked.append((target, attachment, parameter))
            value[0] = sizes[parameter]

        kept.append(signature(answer))
        return ctypes.cast(kept[-1], ctypes.c_void_p).value or 0

    assert GlCalls(load).bits(gl_calls.BACK_LEFT) == 5
    assert asked == [(0x8D40, 0x0402, parameter) for parameter in sizes]


def test_a_window_asks_for_what_is_wanted() -> None:
    import glfw

    deep, plain = context_hints(10), context_hints()
    assert [deep[hint] for hint in (glfw.RED_BITS, glfw.GREEN_BITS, glfw.BLUE_BITS, glfw.ALPHA_BITS)] == [10, 10, 10, 2]
    assert [plain[hint] for hint in (glfw.RED_BITS, glfw.GREEN_BITS, glfw.BLUE_BITS)] == [8, 8, 8]
    assert glfw.ALPHA_BITS not in plain
