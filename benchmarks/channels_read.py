"""OpenEXR pictures of many channels: how many are read, in what time and memory, and reading all of them beside."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

sys.path.insert(0, str(Path(__file__).parent))
from curves import is_quick, program, sized
from promises import Promise, times_as_fast, worst

from stimuli.pictures.exr_views import channel_runs

SIZE_PX = sized((1920, 1080), (96, 54))
CHANNELS = sized((3, 6, 12, 40), (6,))
_MEASURED = """
import json, re, sys, time
from pathlib import Path
import OpenImageIO as oiio
from stimuli.pictures import read_picture
peak = lambda: int(re.search(r"VmHWM:\\s+(\\d+) kB", Path("/proc/self/status").read_text())[1]) / 1e3
before, start = peak(), time.process_time()
if sys.argv[2] == "wanted":
    read_picture(sys.argv[1])
else:
    picture = oiio.ImageInput.open(sys.argv[1])
    picture.read_image(0, 0, 0, picture.spec().nchannels, "float")
print(json.dumps({"seconds": time.process_time() - start, "mb": peak() - before}))
"""


def picture(path: Path, channels: int) -> Path:
    """Write a picture of R, G, B and layers beside them, of noise in half floats."""
    width, height = SIZE_PX
    spec = oiio.ImageSpec(width, height, channels, "half")
    spec.channelnames = ("R", "G", "B", *(f"layer{number:02d}.Z" for number in range(channels - 3)))
    spec.attribute("chromaticities", "float[8]", (0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329))
    spec.attribute("compression", "zip")
    output = oiio.ImageOutput.create(str(path))
    assert output is not None
    assert output.open(str(path), spec)
    pixels = np.random.default_rng(1).random((height, width, channels), dtype=np.float32)
    assert output.write_image(pixels)
    assert output.close()
    return path


def run() -> dict[str, object]:
    """Return a row for each number of channels, read as wanted and all together, in a process each."""
    rows: list[dict[str, object]] = []
    with tempfile.TemporaryDirectory() as folder:
        for channels in CHANNELS:
            path = picture(Path(folder, f"{channels}.exr"), channels)
            for series in ("wanted", "all"):
                command = [sys.executable, "-c", _MEASURED, str(path), series]
                facts = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
                read = sum(map(len, channel_runs([(0, 1, 2)]))) if series == "wanted" else channels
                rows.append(
                    {
                        "series": "cyclopean, R, G and B to XYZ" if series == "wanted" else "OpenImageIO, all channels",
                        "parameter": f"{channels} channels in the file",
                        "seconds": facts["seconds"],
                        "error": 0.0,
                        "read": read,
                        "note": f"{read} of {channels} channels read, {facts['mb']:.0f} MB",
                    }
                )
    most = worst(rows, "read", series="cyclopean")
    promises = [Promise("channels read where R, G and B are wanted", most, 3, "count", "exactly")]
    if not is_quick():
        taken = times_as_fast(
            [row for row in rows if row["parameter"] == f"{max(CHANNELS)} channels in the file"],
            "cyclopean, R, G and B to XYZ",
            "OpenImageIO, all channels",
        )
        promises.append(Promise("beside all of 40 channels", taken, 1.0, "ratio", "at least", "×"))
    return {
        "title": f"Reading OpenEXR of {SIZE_PX[0]} × {SIZE_PX[1]} pixels, in processor time",
        "rows": rows,
        "promises": promises,
    }


if __name__ == "__main__":
    program("channels_read", run)
