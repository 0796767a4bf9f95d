"""Which kind of file it is, by the keys that tell."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType

from documents import Finding, InputError
from documents.yaml.source import read_yaml
from runner.check import experiment, other_kinds
from runner.check.checked import Checked, Wishes

_UNKNOWN = (
    "an experiment has 'blocks:', a display 'modes:', a rig 'mode:', a photodiode's record 'onset_error_ms:', a camera "
    "'matrix_XYZ_cd_m2:', areas to compare 'regions:', a recipe or observers 'kind:'"
)


def check_file(file: Path, wishes: Wishes | None = None) -> Checked:
    """Read ``file``, whichever kind it is, with everything it names, and return what it amounts to and what is wrong.

    Nothing is raised for what people wrote: it is among the errors, all of it.
    """
    checked = Checked(file)
    try:
        data = read_yaml(file).data
        keys = set(data) if isinstance(data, dict) else set()
        reader = next((reader for telling, reader in _READERS.items() if telling in keys), None)
        if reader is None:
            checked.errors.append(Finding("this is no file that cyclopean knows", str(file), remedy=_UNKNOWN))
        else:
            reader(checked, wishes or Wishes())
    except InputError as error:
        checked.errors += error.findings
    return checked


# The first key that is there decides.
_READERS: Mapping[str, Callable[[Checked, Wishes], None]] = MappingProxyType(
    {
        "blocks": experiment.check,
        "modes": other_kinds.check_display,
        "onset_error_ms": other_kinds.check_verification,
        "onsets": other_kinds.check_verification,
        "matrix_XYZ_cd_m2": other_kinds.check_camera,
        "regions": other_kinds.check_regions,
        "mode": other_kinds.check_rig,
        "kind": other_kinds.check_kind,
    }
)
