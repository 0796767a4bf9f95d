"""LibRaw in a process of its own: it reads paths from its input, a line each, and writes what LibRaw reads of them.

A damaged raw file can make LibRaw take all memory, compute for minutes, or end the process that it runs in. Each file
is read in a fork of this process, which has limits by the size that the file declares. Its answer is a line of JSON and
the codes, if there are any; the line ``{"ended": STATUS}`` follows. Where a process
cannot fork, the status is null, and it reads one file.
"""

from __future__ import annotations

import json
import os
import signal
import sys
from functools import partial
from typing import Any

from documents.platform import limit_this_process, run_in_fork

MAX_PHOTOSITES = 200_000_000
# Lossless compression takes a bit for each photosite at least; a sensor in the dark may take less by wavelets.
_MOST_PHOTOSITES_OF_A_BYTE = 64
# Beside what the interpreter itself takes: memory in bytes, and processor time in seconds.
_LEAST_BYTES, _BYTES_OF_A_PHOTOSITE = 600_000_000, 12
_LEAST_S, _PHOTOSITES_IN_A_S = 5, 10_000_000


def serve() -> None:
    """Read paths from the input until it ends."""
    # Ctrl-C is for the process that asks.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    import rawpy  # noqa: F401  # once for all forks

    for line in sys.stdin:
        path = json.loads(line)
        status = run_in_fork(partial(main, path))
        if status is None:
            main(path)
        _reply({"ended": status})
        if status is None:
            return


def main(path: str) -> None:
    """Write what LibRaw reads of the file at ``path``: ``facts`` and ``codes``, or what is wrong with it."""
    import rawpy

    size = os.path.getsize(path)
    limit_this_process(_LEAST_BYTES + 2 * min(size, 1_000_000_000), _LEAST_S)
    try:
        raw = rawpy.RawPy()
        raw.open_file(path)
        photosites = raw.sizes.raw_width * raw.sizes.raw_height
        if photosites > MAX_PHOTOSITES:
            return _refuse("large", f"{raw.sizes.raw_width} × {raw.sizes.raw_height}")
        if photosites > _MOST_PHOTOSITES_OF_A_BYTE * size:
            return _refuse("short", f"{size} bytes, for {photosites} photosites")
        limit_this_process(
            _LEAST_BYTES + 2 * size + _BYTES_OF_A_PHOTOSITE * photosites, _LEAST_S + photosites // _PHOTOSITES_IN_A_S
        )
        raw.unpack()
        return _write(raw)
    except rawpy.LibRawFileUnsupportedError:
        return _refuse("unknown", "")
    except (rawpy.LibRawIOError, rawpy.LibRawDataError):
        return _refuse("damaged", "")
    except rawpy.LibRawError as error:
        return _refuse("refused", str(error).removeprefix("b").strip("'\""))
    except NotImplementedError as error:  # of a colour filter that rawpy does not know
        return _refuse("filter", str(error))
    except MemoryError:
        return _refuse("memory", "")


def _write(raw: Any) -> None:
    import numpy as np

    codes = np.ascontiguousarray(raw.raw_image_visible)
    pattern = raw.raw_pattern
    sizes = raw.sizes
    try:
        # LibRaw's reader of these fields also reads the time of day, which may be none at all.
        other = raw.other
        exposure = [float(other.shutter_speed), float(other.aperture), float(other.iso_speed)]
    except (ValueError, OverflowError, OSError):
        exposure = [0.0, 0.0, 0.0]
    facts = {
        "stack": raw.raw_type.name == "Stack",
        "pattern": None if pattern is None else pattern.tolist(),
        "filters": None if pattern is None else raw.raw_colors_visible[:2, :2].tolist(),
        "colours": int(raw.num_colors),
        "colour_names": raw.color_desc.decode("ascii", "replace"),
        "size_px": [int(sizes.width), int(sizes.height)],
        "flip": int(sizes.flip),
        "white": int(raw.white_level),
        "whites": _numbers(raw.camera_white_level_per_channel),
        "blacks": _numbers(raw.black_level_per_channel),
        "balances": [_numbers(raw.camera_whitebalance), _numbers(raw.daylight_whitebalance)],
        "exposure": exposure,
    }
    _reply({"facts": facts, "shape": list(codes.shape), "dtype": codes.dtype.str})
    sys.stdout.buffer.write(codes.data)
    sys.stdout.buffer.flush()


def _numbers(values: Any) -> list[float] | None:
    return None if values is None else [float(value) for value in values]


def _refuse(kind: str, detail: str) -> None:
    _reply({"wrong": kind, "detail": detail})


def _reply(facts: dict[str, Any]) -> None:
    sys.stdout.buffer.write(json.dumps(facts).encode() + b"\n")
    sys.stdout.buffer.flush()
