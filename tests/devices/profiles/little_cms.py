"""LittleCMS in 64-bit numbers, by way of the library that Pillow brings: what another program makes of a profile."""

from __future__ import annotations

import ctypes
import ctypes.util
from functools import cache
from pathlib import Path

import numpy as np
import PIL
import pytest
from numpy.typing import ArrayLike

from documents.arrays import Floats

RELATIVE_COLORIMETRIC = 1
_DOUBLE = 1 << 22 | 3 << 3
_RGB, _XYZ = 4 << 16 | _DOUBLE, 9 << 16 | _DOUBLE


@cache
def library() -> ctypes.CDLL:
    """Return the library, or skip the test where there is none to be loaded."""
    beside = Path(PIL.__file__).parent
    found = [*beside.parent.glob("pillow.libs/liblcms2*"), *beside.glob(".dylibs/liblcms2*")]
    name = str(found[0]) if found else ctypes.util.find_library("lcms2")
    if name is None:
        pytest.skip("LittleCMS is not there as a library of its own")
    lcms = ctypes.CDLL(name)
    for function in ("cmsOpenProfileFromMem", "cmsCreateXYZProfile", "cmsCreateTransform"):
        getattr(lcms, function).restype = ctypes.c_void_p
    return lcms


def through(profile: bytes, values: ArrayLike, *, back: bool = False, flags: int = 0) -> Floats:
    """Return XYZ (n, 3) of the connection space for codes (n, 3) in 0..1, or, ``back``, codes for XYZ."""
    lcms = library()
    asked = np.ascontiguousarray(values, dtype=np.float64)
    out = np.empty_like(asked)
    own = ctypes.c_void_p(lcms.cmsOpenProfileFromMem(profile, len(profile)))
    assert own.value, "LittleCMS does not open the profile"
    XYZ = ctypes.c_void_p(lcms.cmsCreateXYZProfile())
    ends = (XYZ, _XYZ, own, _RGB) if back else (own, _RGB, XYZ, _XYZ)
    transform = ctypes.c_void_p(lcms.cmsCreateTransform(*ends, RELATIVE_COLORIMETRIC, flags))
    assert transform.value, "LittleCMS makes no transform of the profile"
    lcms.cmsDoTransform(
        transform, asked.ctypes.data_as(ctypes.c_void_p), out.ctypes.data_as(ctypes.c_void_p), len(asked)
    )
    lcms.cmsDeleteTransform(transform)
    lcms.cmsCloseProfile(own)
    lcms.cmsCloseProfile(XYZ)
    return out
