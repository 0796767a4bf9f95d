"""How many observers to ask, from a notebook."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from cyclopean.result import Result
from documents.options import made, taking
from documents.pages import Section

try:
    from extensions.power import PowerOptions, PowerStudy, power_blocks, study_power
except ModuleNotFoundError as error:
    raise ImportError("cyclopean.power is of the extension 'power': install cyclopean again, with it") from error


@taking(PowerOptions, "observers")
def power(experiment: str | Path, numbers_of_observers: Sequence[int], **options: Any) -> Result[PowerStudy]:
    """Simulate studies, to plan how many observers to ask, as `cyclopean power` does and with the same options.

    Parameters
    ----------
    experiment
        An experiment file with a block of all pairs; its stimuli need not be built.
    numbers_of_observers
        The numbers to try.
    **options
        Those of `extensions.power.PowerOptions` by their names, such as ``replicates=100``, ``observer_sd=0.5``, or
        ``scores=``: a file of simulated observers, results or a table of a pilot study, or what
        `cyclopean scores --json` printed.

    Returns
    -------
    Result
        A row for each number of observers; ``title`` says how many are needed.

    Raises
    ------
    InputError
        If a file is wrong, the experiment compares no pairs of a fixed number, or an option is out of range.

    Examples
    --------
    >>> study = power("experiments/dynamic_range.yaml", [20], replicates=50)
    >>> study.to_frame()["observers"].tolist()
    [20]
    """
    asked = made(PowerOptions, {**options, "observers": tuple(numbers_of_observers)})
    study = study_power(Path(experiment), asked)
    answer = study.to_json()
    sizes = [
        ({"group": group["name"]} if "name" in group else {})
        | {key: value for key, value in size.items() if key not in ("items", "pairs")}
        for group in answer.get("groups", [answer])
        for size in group["sizes"]
    ]
    return Result(
        study, sizes, study.needed.sentence, find_sections=lambda: [Section("result", "", power_blocks(study.needed))]
    )
