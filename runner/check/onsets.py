"""What is known of onsets before a screen is there."""

from __future__ import annotations

from pathlib import Path

from devices.display.rig_file import Rig
from documents import Finding
from runner.check.checked import Checked
from runner.session.timing_record import NOT_VERIFIED


def onsets(checked: Checked, rig: Rig) -> None:
    """Say whether onsets were verified with a photodiode, and in what the rig's record of that differs from the rig."""
    verification = rig.photodiode_verification
    if verification is None:
        checked.facts["onsets"] = NOT_VERIFIED
        return
    differs = verification.mismatches(mode=rig.mode, refresh_hz=rig.display.panel.refresh_hz)
    checked.facts["onsets"] = NOT_VERIFIED if differs else verification.sentence()
    if differs:
        what = f"{Path(verification.file).name} does not hold for this rig: {'; '.join(differs)}"
        checked.warnings.append(Finding(what, rig.file, remedy="measure again, or leave it out"))
