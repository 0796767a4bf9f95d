"""Results of sessions: as a table, as a report, as a BIDS dataset."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd

from documents.options import made, taking
from runner.reports import ReportOptions


def read_results(*places: str | Path) -> pd.DataFrame:
    """Read every answered trial of the sessions in ``places``.

    Parameters
    ----------
    places
        Folders of sessions, from one station or many, or single session logs (``session.jsonl``).

    Returns
    -------
    pandas.DataFrame
        One row for each trial, its last attempt: experiment, observer, session, whether the observer was simulated and
        the session is complete, block and trial (from 0), kind, attempt, response time in seconds, UTC, and what the
        kind of block records. For pairs: ``first``, ``second``, ``answer``, ``chosen``, ``rejected``. ``nominal`` is
        the standard that a display which was not measured was taken for, such as ``srgb``: it is there if any was.
        Nested values are columns with dots in their names, such as ``clipping.first.left.delta_e_00_mean``.
        ``seen.mode`` and so on say what the eyes saw in the session: stereo mode, ΔE00 that filters and clipping cost
        over its stimuli, sizes, surround, resampling; what a log does not say is missing.

    Raises
    ------
    InputError
        If a place does not exist or holds no session, or a log is damaged.

    Examples
    --------
    >>> read_results("experiments")
    Traceback (most recent call last):
    ...
    analysis.errors.ResultsError: experiments: the folder holds no session.jsonl (name a folder of results)
    """
    from analysis.records import Seen
    from analysis.records import read_results as read_logs

    logs = read_logs(*places)
    seen = [Seen.of(log).to_json() for log in logs]
    rows = [
        {
            "experiment": log.header.experiment,
            "observer": log.header.observer,
            "session": log.header.session,
            "simulated": log.header.simulated,
            "complete": log.complete,
            **_by_role({key: value for key, value in trial.to_json().items() if key not in ("record", "events")}),
            "seen": what,
        }
        for log, what in zip(logs, seen, strict=True)
        for trial in log.trials
    ]
    return pd.json_normalize(rows)


def verify(*places: str | Path, mirror: str | Path | None = None, key: str | Path | None = None) -> pd.DataFrame:
    """Check that results are as they were recorded: each line's checksum, the copy of each log, and the seals.

    Parameters
    ----------
    places
        Folders of results, from one station or many, or single logs.
    mirror
        Folder of the copies; None for the one that the rig of a session named, if it lies in one of the ``places``.
    key
        File of the public key of who sealed the results: a seal that it signed must name each log; None if none need.

    Returns
    -------
    pandas.DataFrame
        One row for each log of a session or a measurement: ``file``, ``kind``, ``lines``, ``chained_from`` (the first
        line with a checksum; missing: the log is unchained, nothing protects it), ``complete``, ``torn_bytes`` of an
        unfinished last line, ``digest``, ``mirror`` (how the copy compares) and ``findings``, a list of sentences,
        empty if all fits. Then one for each seal, of the kind ``seal``, with its SHA-256 as ``digest``, what is not as
        sealed, and what is known of its ``signature``; then one for each file that cannot be read, without a kind.

    Raises
    ------
    InputError
        If a place or the key does not exist, or a place holds no log.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from runner.session import simulate
    >>> experiment, observers = "experiments/dynamic_range.yaml", "configs/observers/table_4_4.yaml"
    >>> with TemporaryDirectory() as folder:
    ...     _ = simulate(experiment, observers, 1, results=folder)
    ...     table = verify(folder)
    >>> table[["lines", "chained_from", "complete", "findings"]].values.tolist()
    [[48, 1, True, []]]
    """
    from analysis.seals import check_results

    checked = check_results(*places, mirror=mirror, key=key)
    rows = [log.to_json() | {"findings": list(map(str, log.findings))} for log in checked.logs]
    for seal in checked.seals:
        told = {"digest": seal.seal.digest, "signature": seal.signature}
        rows.append({"file": str(seal.seal.file), "kind": "seal", **told, "findings": list(map(str, seal.findings))})
    by_file = {row["file"]: row for row in rows}
    for finding in checked.others:
        if finding.file not in by_file:
            rows.append(by_file.setdefault(finding.file, {"file": finding.file, "findings": []}))
        by_file[finding.file]["findings"].append(str(finding))
    return pd.DataFrame(rows).astype(dict.fromkeys(("lines", "chained_from", "torn_bytes"), "Int64"), errors="ignore")


@taking(ReportOptions)
def report(*places: str | Path, output: str | Path | None = None, **options: Any) -> Path:
    """Write the HTML report on the results of one experiment, as `cyclopean report` does and with the same options.

    Parameters
    ----------
    places
        Folders of sessions, or single session logs.
    output
        The page to write; ``report.html`` in the first folder if None.
    **options
        Those of `runner.reports.ReportOptions` and of `analysis.observers.Filter` by their names, such as ``pdf=True``,
        ``alpha=0.01``, ``without=("03",)`` or ``with_simulated=True``.

    Returns
    -------
    pathlib.Path
        The page.

    Raises
    ------
    InputError
        If results are missing, damaged or of different experiments.
    """
    from runner.reports import report_results

    page = None if output is None else Path(output)
    return report_results([Path(place) for place in places], page, made(ReportOptions, options)).page


def _by_role(trial: dict[str, Any]) -> dict[str, Any]:
    """Return a trial's values with the clipping of ``first`` and ``second`` under these names, not the stimuli's."""
    clipping = trial.get("clipping")
    roles = {role: trial[role] for role in ("first", "second") if isinstance(trial.get(role), str)}
    if not isinstance(clipping, dict) or set(clipping) != set(roles.values()):
        return trial
    return {**trial, "clipping": {role: clipping[name] for role, name in roles.items()}}
