"""What of a built set a display cannot show bright enough; counted once for a set and a display."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable, Mapping
from pathlib import Path

from documents.files.hashes import sha256_of_json
from documents.files.whole_file import write_whole
from stimuli.build.stimulus_set import StimulusSet
from stimuli.luminance.saturation import saturation
from stimuli.recipes.build_context import DisplaySetup

# Percentages by channel, and of pixels with any of them, for each eye.
Saturated = Mapping[str, Mapping[str, float]]


def saturated_percent(
    made: StimulusSet, setup: DisplaySetup, report: Callable[[int, int], None] = lambda done, of: None
) -> dict[str, Saturated]:
    """Return for each stimulus and eye the percentage of pixels that ask the display for more than full light.

    Pictures are only read where the numbers for these very pictures and this display's range are not kept yet.
    """
    key = sha256_of_json([made.digest, setup.range_json()])[:16]
    record = made.folder.with_name(f".{made.folder.name}-saturated-{key}.json")
    with contextlib.suppress(OSError, ValueError):
        kept = json.loads(record.read_text(encoding="utf-8"))
        if isinstance(kept, dict) and kept.keys() == set(made.names):
            return kept
    found: dict[str, Saturated] = {}
    for done, name in enumerate(made.names):
        report(done, len(made.names))
        image = made.load(name)
        left = saturation(image.left, setup.models.left).to_json()
        same = image.is_flat and setup.models.left is setup.models.right
        found[name] = {"left": left, "right": left if same else saturation(image.right, setup.models.right).to_json()}
    report(len(made.names), len(made.names))
    _keep(record, found)
    return found


def _keep(record: Path, found: dict[str, Saturated]) -> None:
    """Write the record as a whole; where the cache cannot be written, the numbers are counted again next time."""
    with contextlib.suppress(OSError):
        write_whole(record, json.dumps(found))
