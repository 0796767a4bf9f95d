"""BIDS labels: letters and digits only, which also keeps them out of other folders."""

from __future__ import annotations

import re
from pathlib import Path

from analysis.errors import ResultsError
from documents import Finding

_LABEL = re.compile(r"[0-9A-Za-z]{1,64}")


def check_label(what: str, label: object, file: Path) -> str:
    """Return ``label`` if it is a BIDS label; ``what`` names it in the error.

    Raises
    ------
    ResultsError
        If it is not; ``file`` is named.
    """
    if not isinstance(label, str) or not _LABEL.fullmatch(label):
        raise ResultsError(
            Finding(
                f"the {what} {label!r} is no BIDS label",
                str(file),
                1,
                1,
                "use up to 64 letters and digits in the file's header",
            )
        )
    return label


def task_label(experiment: object, file: Path) -> str:
    """Return the experiment's name as a task label: its letters and digits, as BIDS recommends.

    Raises
    ------
    ResultsError
        If nothing is left of the name; ``file`` is named.
    """
    label = re.sub(r"[^0-9A-Za-z]", "", experiment) if isinstance(experiment, str) else experiment
    return check_label("experiment", label or experiment, file)
