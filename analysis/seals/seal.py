"""The seal of a folder of results: the SHA-256 of every file in it, in `seal.json`, which a paper can cite.

A seal shows that nothing was changed, added or removed since. It is as good as the place where its own SHA-256 is
printed, for who can write the folder can also seal it again; or as the key that it is signed with
(`analysis.seals.signing`).
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, ClassVar, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from analysis.errors import ResultsError
from analysis.records.session_record import SessionLog
from analysis.seals.signing import SIGNATURE, Key, fault_of_signature, sign
from documents import Finding
from documents.files import looked_for, read_regular, sha256_of_file, write_whole
from documents.text import JsonResult, counted
from documents.yaml import Count

SEAL = "seal.json"
# What `report` writes into a folder of results: made again from the sealed files at any time.
_DERIVED = ("report.html", "report.pdf")
_MOST_BYTES = 100_000_000
_ABOVE = 3  # folders above a log in which its seal is looked for: observer, experiment, results

Sha256 = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]


class SealContent(BaseModel):
    """What `seal.json` says: when it was made, of what, with what, and the SHA-256 of each ``file``."""

    model_config = ConfigDict(extra="allow", frozen=True)

    schema_version: Literal[1]
    sealed_utc: str
    experiments: tuple[str, ...]
    sessions: Count
    observers: Count
    software: Mapping[str, str]
    packages: Mapping[str, str]
    replaces: Sha256 | None = None
    files: Mapping[str, Sha256]


@dataclass(frozen=True, slots=True)
class Seal(JsonResult):
    """The seal at ``file``, with its bytes ``data``; ``digest`` is their SHA-256, for a paper to cite.

    ``key`` is the file of the key that it was just signed with.
    """

    file: Path
    data: bytes
    content: SealContent
    key: Path | None = None
    json_names: ClassVar = "file digest content"
    json_keys: ClassVar = {"file": "seal", "digest": "sha256", "content": "*"}

    @property
    def digest(self) -> str:
        """The SHA-256 of the file."""
        return hashlib.sha256(self.data).hexdigest()

    def told(self) -> Iterator[str]:
        """Yield what was sealed, how to cite it, and how to compare the folder with it."""
        content, folder = self.content, self.file.parent
        people = counted(content.observers, "observer", "observers")
        sessions = f"{counted(content.sessions, 'session', 'sessions')} of {people}"
        yield f"Sealed: {counted(len(content.files), 'file', 'files')}, {sessions}: {self.file}"
        yield f"Cite it by its SHA-256: {self.digest}"
        if self.key is not None:
            yield f"Signed: {folder / SIGNATURE}"
        with_key = f" --key {self.key}" if self.key else ""
        yield f"Compare the folder with it: cyclopean verify {folder}{with_key}"


@dataclass(frozen=True, slots=True)
class SealCheck(JsonResult):
    """Whether a folder is as it was sealed: ``findings`` are the files that changed, are missing or came later.

    ``signed`` says that there is a signature; ``signed_by`` is the name of the key that was given and that it fits,
    None if none was given or it does not fit: then that is a finding too.
    """

    seal: Seal
    findings: tuple[Finding, ...]
    signed: bool = False
    signed_by: str | None = None
    json_names: ClassVar = "seal.file seal.digest signed signed_by changed"
    json_keys: ClassVar = {"seal.file": "seal", "seal.digest": "sha256", "changed": "findings"}

    @property
    def signature(self) -> str:
        """What is known of its signature, in words."""
        if self.signed_by is not None:
            return f"signed by the key {self.signed_by}"
        return "signed, not checked without --key" if self.signed else "not signed"

    @property
    def changed(self) -> list[dict[str, str | None]]:
        """What differs, by file."""
        return [{"file": finding.file, "message": finding.message} for finding in self.findings]


def files_to_seal(folder: Path) -> Iterator[Path]:
    """Yield the files that a seal of ``folder`` names: all but hidden ones, the seal, its signature, pages of `report`.

    Raises
    ------
    ResultsError
        At a symbolic link: what it leads to is not part of the folder.
    """
    for path in sorted(folder.rglob("*")):
        within = path.relative_to(folder)
        if any(part.startswith(".") for part in within.parts) or within.name in (SEAL, SIGNATURE):
            continue
        if path.is_symlink():
            what = "a symbolic link cannot be sealed: what it leads to may change without it"
            raise ResultsError(Finding(what, str(path), remedy="put a copy of the file in its place"))
        if path.is_file() and path.name not in _DERIVED:
            yield path


def hashes_of(folder: Path) -> dict[str, str]:
    """Return the SHA-256 of each file of ``folder`` that a seal names, by its path in there with forward slashes."""
    return {file.relative_to(folder).as_posix(): sha256_of_file(file) for file in files_to_seal(folder)}


def read_seal(folder: Path) -> Seal | None:
    """Return the seal of ``folder``; None if there is none.

    Parameters
    ----------
    folder
        Folder of results.

    Returns
    -------
    Seal or None
        What `seal.json` in there says.

    Raises
    ------
    ResultsError
        If there is such a file and it is no seal.

    Examples
    --------
    >>> read_seal(Path("experiments")) is None
    True
    """
    file = folder / SEAL
    if not os.path.lexists(file):
        return None
    data = read_regular(file, _MOST_BYTES, "seal", error=ResultsError)
    try:
        content = SealContent.model_validate_json(data)
    except ValidationError as error:
        first = error.errors(include_url=False, include_context=False)[0]
        where = ".".join(map(str, first["loc"]))
        what = f"this is no seal: {where + ': ' if where else ''}{first['msg']}"
        raise ResultsError(Finding(what, str(file), remedy="restore the file, or seal the results again")) from error
    return Seal(file, data, content)


def check_seal(folder: Path, key: Key | None = None) -> SealCheck:
    """Compare a folder of results with its seal.

    Parameters
    ----------
    folder
        Folder of results that was sealed.
    key
        With which the seal must be signed; None if that is not asked.

    Returns
    -------
    SealCheck
        The files that changed, are missing or came later, and whether the signature fits.

    Raises
    ------
    ResultsError
        If the folder was not sealed, or its seal is damaged.

    Examples
    --------
    >>> check_seal(Path("experiments"))
    Traceback (most recent call last):
    ...
    analysis.errors.ResultsError: experiments: the folder has no seal.json (seal it: cyclopean seal experiments)
    """
    seal = read_seal(folder)
    if seal is None:
        remedy = f"seal it: cyclopean seal {folder}" if folder.is_dir() else looked_for(folder)
        raise ResultsError(Finding(f"the folder has no {SEAL}", str(folder), remedy=remedy))
    sealed, now = seal.content.files, hashes_of(folder)
    findings = [
        Finding(what, str(folder / name))
        for names, what in (
            (sealed.keys() - now.keys(), "this file was sealed and is missing"),
            ({name for name in sealed.keys() & now.keys() if sealed[name] != now[name]}, "this file is not as sealed"),
            (now.keys() - sealed.keys(), "this file is not in the seal"),
        )
        for name in sorted(names)
    ]
    signed, signed_by = os.path.lexists(folder / SIGNATURE), None
    if key is not None:
        if fault := fault_of_signature(seal.data, key, folder):
            findings.append(fault)
        else:
            signed_by = key.name
    return SealCheck(seal, tuple(findings), signed, signed_by)


def seals_of(sessions: Sequence[SessionLog]) -> dict[Path, list[SessionLog]]:
    """Return the sessions below each folder that has a seal; the nearest folder counts."""
    by_folder: dict[Path, list[SessionLog]] = {}
    for session in sessions:
        above = session.file.absolute().parents[: _ABOVE + 1]
        if folder := next((place for place in above if (place / SEAL).is_file()), None):
            by_folder.setdefault(folder, []).append(session)
    return by_folder


def notes_on_seals(sessions: Sequence[SessionLog]) -> Iterator[str]:
    """Yield, for a report, whether the logs of ``sessions`` are as they were sealed."""
    for folder, inside in seals_of(sessions).items():
        try:
            seal = read_seal(folder)
        except ResultsError as error:
            yield f"{error}."
            continue
        if seal is None:
            continue
        names = {log.file.absolute().relative_to(folder).as_posix(): log.file for log in inside}
        other = [name for name, file in names.items() if seal.content.files.get(name) != sha256_of_file(file)]
        words = f"The results were sealed on {seal.content.sealed_utc[:10]}, SHA-256 of {SEAL} {seal.digest}"
        if other:
            yield f"{words}, and {len(other)} of {len(names)} logs are not as sealed, such as {min(other)}."
        else:
            yield f"{words}; the logs are as sealed."


def write_seal(
    folder: Path,
    sessions: Sequence[SessionLog],
    software: Mapping[str, str],
    packages: Mapping[str, str],
    key: Key | None = None,
) -> Seal:
    """Seal ``folder``, in which ``sessions`` lie; the new seal names the SHA-256 of one that it replaces.

    Parameters
    ----------
    folder
        Folder of results.
    sessions
        Its sessions.
    software, packages
        Versions by name, for the record.
    key
        The private key to sign the seal with; None leaves it unsigned, and a signature of a seal before is removed.

    Returns
    -------
    Seal
        The seal, as it was written.

    Raises
    ------
    ResultsError
        If a file is a symbolic link, or there is a seal that is damaged.
    OSError
        If the seal cannot be written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     _ = Path(folder, "a.txt").write_text("a")
    ...     dict(write_seal(Path(folder), [], {}, {}).content.files)["a.txt"][:8]
    'ca978112'
    """
    before = read_seal(folder)
    content = SealContent(
        schema_version=1,
        sealed_utc=datetime.now(UTC).isoformat(timespec="seconds"),
        experiments=tuple(sorted({session.header.experiment for session in sessions})),
        sessions=len(sessions),
        observers=len({session.header.observer for session in sessions}),
        software=software,
        packages=packages,
        replaces=before.digest if before else None,
        files=hashes_of(folder),
    )
    text = json.dumps(content.model_dump(mode="json", exclude_none=True), indent=1, ensure_ascii=False) + "\n"
    (folder / SIGNATURE).unlink(missing_ok=True)  # of the seal before
    write_whole(folder / SEAL, text, private=True)
    data = text.encode("utf-8")
    if key is not None:
        sign(data, key, folder)
    return Seal(folder / SEAL, data, content, None if key is None else key.file)
