"""Sealing a folder of results: the SHA-256 of every file, and what the sessions were made with, in one file."""

from __future__ import annotations

import importlib.metadata
from pathlib import Path

from analysis.records import read_results
from analysis.seals import SIGNATURE, Seal, read_private_key, read_seal, write_seal
from documents import Finding
from documents.text import counted
from runner.errors import SessionError
from runner.session.folders import is_running
from runner.session.header import software


def seal_results(results: str | Path, *, replace: bool = False, key: str | Path | None = None) -> Seal:
    """Write `seal.json` into a folder of results: the SHA-256 of every file, for a paper to cite.

    Sealed are the session logs, the configuration that they were made with (experiment, rig, display, recipe, and the
    manifest with the SHA-256 of every picture), and whatever else lies in the folder, but for hidden files and the
    pages that `report` writes. The versions of all installed packages stand beside.

    Parameters
    ----------
    results
        Folder of results.
    replace
        Whether to seal again a folder that has a seal; the new one names the SHA-256 of the one that it replaces.
    key
        File of a private key to sign the seal with, as `new_key` makes one; None leaves it unsigned.

    Returns
    -------
    Seal
        The seal, and its own SHA-256.

    Raises
    ------
    InputError
        If the folder holds no session, a log is damaged or being written, a file is a symbolic link, there is a seal
        already, a signed one would be replaced by one that is not, or the key cannot sign.
    OSError
        If the seal cannot be written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from analysis.seals import check_seal
    >>> from runner.session import simulate
    >>> experiment, observers = "experiments/dynamic_range.yaml", "configs/observers/table_4_4.yaml"
    >>> with TemporaryDirectory() as folder:
    ...     done = simulate(experiment, observers, 1, results=folder)
    ...     seal = seal_results(folder)
    ...     check_seal(Path(folder)).findings, seal.content.sessions
    ((), 1)
    """
    folder = Path(results)
    sessions = read_results(folder)
    if not folder.is_dir():
        raise SessionError(Finding("only a folder can be sealed", str(folder), remedy="name a folder of results"))
    before = read_seal(folder)
    if before is not None and not replace:
        remedy = f"compare with it: cyclopean verify {folder}, or seal again with --replace"
        what = f"these results were sealed on {before.content.sealed_utc}"
        raise SessionError(Finding(what, str(before.file), remedy=remedy))
    if before is not None and key is None and (folder / SIGNATURE).exists():
        remedy = "sign the new seal too: --key FILE"
        raise SessionError(Finding("the seal before was signed", str(folder / SIGNATURE), remedy=remedy))
    signer = None if key is None else read_private_key(Path(key), folder)
    running = [session.file for session in sessions if is_running(session.file.parent)]
    if running:
        what = f"{counted(len(running), 'session is', 'sessions are')} being written"
        raise SessionError(Finding(what, str(running[0]), remedy="seal the results once it has ended"))
    packages = sorted((package.name.lower(), package.version) for package in importlib.metadata.distributions())
    return write_seal(folder, sessions, software(), dict(packages), signer)
