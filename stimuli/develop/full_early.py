"""Sensors that fill up below the white level that their files declare."""

from __future__ import annotations

from collections.abc import Iterator

from stimuli.develop.camera_image import CameraImage

# Noise seldom lets so many photosites meet at the largest code.
_MANY = 20


def full_early(image: CameraImage) -> Iterator[str]:
    """Yield a remark where many photosites share the largest code although it is not yet one of a full one."""
    for step in image.steps:
        if step["step"] == "linearise":
            largest, many, full = step["largest_code"], step["photosites_at_largest_code"], min(step["saturated_from"])
            if largest < full and many >= _MANY:
                yield (
                    f"{many} photosites share the largest code, {largest}, below {full:g}: if it is full there, "
                    f"tell --saturated {largest}"
                )
