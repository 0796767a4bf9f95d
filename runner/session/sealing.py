"""Sealing a folder of results: the SHA-256 of every file, and what the sessions were made with, in one file."""

from __future__ import annotations

import importlib.metadata
from pathlib import Path
from typing import Annotated

from analysis.records import read_results
from analysis.seals import SIGNATURE, Seal, read_private_key, read_seal, write_seal
from analysis.seals import new_key as make_key
from documents import Finding, WorkError
from documents.files import writing
from documents.options import Typed
from documents.text import JsonResult, counted
from runner.errors import SessionError
from runner.session.folders import is_running
from runner.session.header import software


def seal(
    results: Annotated[str | Path | None, Typed(metavar="RESULTS", place=True)] = None,
    *,
    replace: bool = False,
    key: str | Path | None = None,
    new_key: str | Path | None = None,
) -> JsonResult:
    """Write down the SHA-256 of every file of results.

    RESULTS is a folder of sessions. Its file seal.json then names every session log, the experiment, rig, display,
    recipe and pictures that the sessions were made with, and the versions of all packages. `cyclopean verify` compares
    the folder with it. With --key it is signed (seal.sig): `cyclopean verify --key FILE.pub` then tells whether it is
    yours. --new-key makes such a key, once, and seals nothing.

    Parameters
    ----------
    results
        Folder of results.
    replace
        Seal again; the new seal names the one that it replaces.
    key
        Private key to sign the seal with.
    new_key
        Make a private key FILE, and FILE.pub for others.

    Returns
    -------
    Seal or Key
        The seal, and its own SHA-256; or the key that was made.

    Raises
    ------
    InputError
        If the folder holds no session, a log is damaged or being written, a file is a symbolic link, there is a seal
        already, a signed one would be replaced by one that is not, or the key cannot sign.
    WorkError
        If the seal or the key cannot be written.
    """
    if new_key is not None:
        if results is not None or key is not None or replace:
            raise SessionError("--new-key makes a key and seals nothing: give it alone")
        with writing(Path(new_key), "key", WorkError):
            return make_key(Path(new_key))
    if results is None:
        raise SessionError("no folder of RESULTS is named")
    with writing(Path(results), "seal", WorkError):
        return seal_results(results, replace=replace, key=key)


def seal_results(results: str | Path, *, replace: bool = False, key: str | Path | None = None) -> Seal:
    """Seal a folder of results, as `seal` does. Raises InputError, and OSError where the seal cannot be written.

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
