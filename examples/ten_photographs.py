"""Ten stereo pairs of one still life, from pale to gaudy, as ordinary JPEG files: pictures to try a study with.

    python examples/ten_photographs.py photos

Five balls on a table are seen by two cameras, 65 mm apart. The files are called such as photo1_L.jpg and photo1_R.jpg.
"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image

SIZE_PX = 1200, 800
LAMP = np.array([0.5, 0.9, -0.6]) / np.linalg.norm([0.5, 0.9, -0.6])
BALLS = [  # x, y, z and radius in metres, and colour
    ((-0.55, 0.22, 2.2), 0.22, (0.80, 0.25, 0.15)),
    ((0.05, 0.30, 2.6), 0.30, (0.20, 0.45, 0.75)),
    ((0.60, 0.20, 2.1), 0.20, (0.85, 0.70, 0.20)),
    ((-0.15, 0.12, 1.7), 0.12, (0.30, 0.65, 0.30)),
    ((0.30, 0.10, 1.6), 0.10, (0.75, 0.70, 0.70)),
]


def photograph(camera_x: float) -> np.ndarray:
    """Return linear RGB (rows, columns, 3) as a camera at ``camera_x`` metres sees it; 2 m away lies the screen."""
    width, height = SIZE_PX
    x, y = np.meshgrid(np.arange(width) - width / 2, height / 2 - np.arange(height))
    ray = np.stack([x / width * 1.1 - camera_x / 2.0, y / width * 1.1 - 0.12, np.ones_like(x)], axis=-1)
    ray /= np.linalg.norm(ray, axis=-1, keepdims=True)
    eye = np.array([camera_x, 0.55, 0.0])
    with np.errstate(divide="ignore"):
        depth = np.where(ray[..., 1] < 0, -eye[1] / ray[..., 1], np.inf)
    place = eye + np.where(np.isfinite(depth), depth, 0.0)[..., None] * ray
    board = np.where((np.floor(place[..., 0] * 5) + np.floor(place[..., 2] * 5)) % 2, 0.55, 0.35)
    shade = np.ones_like(depth)
    for centre, radius, _ in BALLS:  # the shadows of the balls
        to_ball = np.array(centre) - place
        along = to_ball @ LAMP
        shade = np.where((along > 0) & (np.sum(to_ball**2, axis=-1) - along**2 < radius**2), 0.35, shade)
    far = np.exp(-np.where(np.isfinite(depth), depth, 9.0) / 6.0)[..., None]
    picture = far * (board * shade)[..., None] * [1.0, 0.9, 0.75] + (1 - far) * [0.45, 0.55, 0.65]
    for centre, radius, colour in BALLS:
        to_ball = np.array(centre) - eye
        along = ray @ to_ball
        inside = radius**2 - (to_ball @ to_ball - along**2)
        near = along - np.sqrt(np.maximum(inside, 0.0))
        normal = (eye + near[..., None] * ray - np.array(centre)) / radius
        light = 0.15 + 0.85 * np.maximum(normal @ LAMP, 0.0)
        mirrored = ray - 2 * np.sum(ray * normal, axis=-1, keepdims=True) * normal
        shine = np.maximum(mirrored @ LAMP, 0.0) ** 60
        seen = (inside > 0) & (near < depth)
        picture = np.where(seen[..., None], light[..., None] * np.array(colour) + shine[..., None], picture)
        depth = np.where(seen, near, depth)
    return picture


def developed(linear: np.ndarray, colourfulness: float) -> Image.Image:
    """Return 8-bit sRGB with more or less colour."""
    grey = linear.mean(axis=-1, keepdims=True)
    rgb = np.clip(grey + colourfulness * (linear - grey), 0.0, 1.0)
    coded = np.where(rgb <= 0.0031308, 12.92 * rgb, 1.055 * rgb ** (1 / 2.4) - 0.055)
    return Image.fromarray(np.round(255 * coded).astype(np.uint8))


folder = Path(sys.argv[1] if len(sys.argv) > 1 else "photos")
folder.mkdir(parents=True, exist_ok=True)
for eye, camera_x in (("L", -0.0325), ("R", 0.0325)):
    view = photograph(camera_x)
    for number, colourfulness in enumerate(np.linspace(0.2, 2.0, 10), start=1):
        developed(view, colourfulness).save(folder / f"photo{number}_{eye}.jpg", quality=92)
print(f"{folder}: ten pairs of {SIZE_PX[0]} x {SIZE_PX[1]} pixels")
