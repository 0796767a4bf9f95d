"""What eyes are called; ``both`` where a picture or a reading is of no eye in particular."""

from __future__ import annotations

from typing import Literal

Eye = Literal["left", "right"]
AnyEye = Literal["left", "right", "both"]
EYES: tuple[Eye, Eye] = ("left", "right")
