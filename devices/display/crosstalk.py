"""Light that leaks from one eye's picture into the other eye, and what to show so that each eye sees what was asked.

In linear XYZ above each eye's black, light being additive (A. J. Woods, "Crosstalk in stereoscopic displays: a
review", Journal of Electronic Imaging 21 (2012) 040902)::

    seen_left  = L + K_left  · R
    seen_right = R + K_right · L

L and R are what the display sends to each eye through its own lens, K_left and K_right matrices (3, 3): K_left maps the
light that the right eye would see to the light that reaches the left eye instead. The two lines are one system of six
equations, the same at every pixel, so that its inverse is computed once.

A leak may be negative: some LCD systems show an eye less light where the other eye's picture is brighter [Baker2016].
The equations are the same; what has to be added for it is light that the eye's own picture cannot have near white.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from devices.errors import DeviceError
from documents.arrays import Floats

# Beyond this the two eyes see almost the same mixture, and readings' noise decides what is shown.
_MOST_CONDITION = 1e6
# A leak of less than this share of the light that leaks is next to none, be it below nothing or above.
NOISE_SHARE = 1e-3


@dataclass(frozen=True, eq=False)
class Crosstalk:
    """What leaks into each eye: ``left`` is K_left and ``right`` K_right, shape (3, 3) each, without unit.

    Raises
    ------
    DeviceError
        If a matrix is not (3, 3), holds a number that is not finite, or both together cannot be undone.
    """

    left: Floats
    right: Floats

    def __post_init__(self) -> None:
        for eye in ("left", "right"):
            matrix = np.array(getattr(self, eye), dtype=np.float64)
            if matrix.shape != (3, 3) or not np.all(np.isfinite(matrix)):
                raise DeviceError(f"the {eye} eye's crosstalk must be 3 × 3 finite numbers, not {matrix.tolist()}")
            matrix.flags.writeable = False
            object.__setattr__(self, eye, matrix)
        condition = np.linalg.cond(self.mixing)
        if not condition <= _MOST_CONDITION:
            raise DeviceError(
                f"the two eyes see so nearly the same mixture that it cannot be undone (condition {condition:.3g}, "
                f"at most {_MOST_CONDITION:.0e}); check which eye's picture each reading was of"
            )

    @cached_property
    def mixing(self) -> Floats:
        """The matrix (6, 6) from what is sent, left XYZ then right XYZ, to what is seen."""
        return np.block([[np.eye(3), self.left], [self.right, np.eye(3)]])

    @cached_property
    def unmixing(self) -> Floats:
        """The inverse of `mixing`."""
        return np.asarray(np.linalg.inv(self.mixing))

    def seen(self, left: ArrayLike, right: ArrayLike) -> tuple[Floats, Floats]:
        """Return what each eye sees of what is sent, XYZ above black in cd/m², any shape (..., 3), the same for both.

        Raises
        ------
        DeviceError
            If the shapes differ or are not (..., 3), or a value is not finite.
        """
        return _apply(self.mixing, left, right)

    def solve(self, left: ArrayLike, right: ArrayLike) -> tuple[Floats, Floats]:
        """Return what to send so that each eye sees ``left`` and ``right``; undoes `seen`, and may be negative.

        XYZ above black in cd/m², any shape (..., 3), the same for both eyes. Raises as `seen` does.
        """
        return _apply(self.unmixing, left, right)

    def swapped(self) -> Crosstalk:
        """Return the crosstalk with the eyes exchanged."""
        return Crosstalk(self.right, self.left)


def _apply(matrix: Floats, left: ArrayLike, right: ArrayLike) -> tuple[Floats, Floats]:
    seen_left, seen_right = np.asarray(left, dtype=np.float64), np.asarray(right, dtype=np.float64)
    if seen_left.shape != seen_right.shape or seen_left.shape[-1:] != (3,):
        raise DeviceError(
            f"the left eye's light has shape {seen_left.shape} and the right eye's {seen_right.shape}; expected one"
        )
    for eye, light in (("left", seen_left), ("right", seen_right)):
        if not np.all(np.isfinite(light)):
            raise DeviceError(f"{np.count_nonzero(~np.isfinite(light))} values of the {eye} eye's light are not finite")
    both = np.concatenate([seen_left, seen_right], axis=-1) @ matrix.T
    return both[..., :3], both[..., 3:]


def check_leakage(crosstalk: Crosstalk, left_primaries_XYZ: ArrayLike, right_primaries_XYZ: ArrayLike) -> None:
    """Refuse leaks that no glasses have, judged on the display's own colours. A leak may be negative.

    ``left_primaries_XYZ`` and ``right_primaries_XYZ`` are (3, 3) in cd/m², their columns the red, green and blue that
    each eye sees of its own picture.

    Raises
    ------
    DeviceError
        If the luminance that the other eye's red, green, blue or white adds, or takes, is more than the other eye
        itself sees of it.
    """
    sides = (("left", crosstalk.left, right_primaries_XYZ), ("right", crosstalk.right, left_primaries_XYZ))
    for eye, matrix, primaries in sides:
        columns = np.asarray(primaries, dtype=np.float64)
        colours = np.column_stack([columns, columns.sum(axis=1)])
        for name, sent in zip(("red", "green", "blue", "white"), colours.T, strict=True):
            refuse_leak(eye, name, float((matrix @ sent)[1]), float(sent[1]))


WRONG_LENS_SHARE = 0.9
"""Of an eye's own light: where its lens passes so much of the other eye's, it is the other eye's lens, or none."""


def wrong_lens(eye: str, own_cd_m2: float, leaked_cd_m2: float) -> str | None:
    """Return what is wrong, and what to do, where a lens passes the other eye's white as its own; None if it does not.

    Both are above the eye's black.
    """
    if leaked_cd_m2 < WRONG_LENS_SHARE * own_cd_m2 or leaked_cd_m2 <= 0.0:
        return None
    other = "right" if eye == "left" else "left"
    return (
        f"through the {eye} lens the {other} eye's white gives {leaked_cd_m2:.4g} cd/m², and the {eye} eye's own "
        f"{own_cd_m2:.4g}: put the {eye} eye's lens before the instrument; if it is, the glasses are off or the eyes "
        "are exchanged (swap_eyes)"
    )


def refuse_leak(eye: str, colour: str, leaked_cd_m2: float, sent_cd_m2: float) -> None:
    """Raise DeviceError if ``leaked_cd_m2``, which may be negative, is more than all of ``sent_cd_m2``."""
    if abs(leaked_cd_m2) <= sent_cd_m2:
        return
    other = "right" if eye == "left" else "left"
    what = "loses" if leaked_cd_m2 < 0 else "sees"
    raise DeviceError(
        f"the {eye} eye {what} {abs(leaked_cd_m2):.4g} cd/m² of the {other} eye's {colour} ({sent_cd_m2:.4g} cd/m²), "
        f"more than all of it; subtract the {eye} eye's black, and check which lens and which picture were measured"
    )
