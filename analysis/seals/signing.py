"""Signatures of seals: Ed25519 [Josefsson2017] over the bytes of `seal.json`, beside it as the 64 bytes of `seal.sig`.

The package cryptography does it, an extra that is imported only when a key is used. Keys are PEM files, as other
programs make and take them.
"""

from __future__ import annotations

import hashlib
import os
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from analysis.errors import ResultsError
from documents import Finding
from documents.files import inside, read_regular, whole_file
from documents.text import JsonResult

SIGNATURE = "seal.sig"
_BYTES = 64
_MOST_KEY_BYTES = 10_000
_FINGERPRINT = 16
_PUBLIC = ".pub"


@dataclass(frozen=True, slots=True)
class Key(JsonResult):
    """A key that was read: ``private`` if it can sign, and ``public``, as the package cryptography has them.

    ``name`` are the first digits of the SHA-256 of the public key: enough to tell keys apart.
    """

    file: Path
    private: Any | None
    public: Any
    name: str
    json_names: ClassVar = "file public_file name"
    json_keys: ClassVar = {"file": "private_key", "public_file": "public_key"}

    @property
    def public_file(self) -> str:
        """The file beside it, for others."""
        return f"{self.file}{_PUBLIC}"

    def told(self) -> Iterator[str]:
        """Yield what each of the two files is for."""
        yield f"Private key: {self.file}. Keep it from others, and a copy of it: it cannot be made again."
        yield f"Public key, for all who are to check what you sign: {self.public_file}, named {self.name}"
        yield f"Sign with it: cyclopean seal RESULTS --key {self.file}"


def new_key(file: Path) -> Key:
    """Make a private key at ``file``, which its owner alone may read, and the public one beside it, ``FILE.pub``.

    Raises
    ------
    ResultsError
        If either file exists, or the package cryptography is not installed.
    OSError
        If they cannot be written.
    """
    keys, forms = _library()
    public_file = file.with_name(file.name + _PUBLIC)
    for path in (file, public_file):
        if os.path.lexists(path):
            remedy = "name another file: what was signed with a key that is lost cannot be signed again"
            raise ResultsError(Finding("there is a file already", str(path), remedy=remedy))
    private = keys.Ed25519PrivateKey.generate()
    pem, plain = forms.Encoding.PEM, forms.NoEncryption()
    _write_private(file, private.private_bytes(pem, forms.PrivateFormat.PKCS8, plain))
    with whole_file(public_file) as draft:
        draft.write_bytes(private.public_key().public_bytes(pem, forms.PublicFormat.SubjectPublicKeyInfo))
    return _key(file, private, private.public_key())


def _write_private(file: Path, content: bytes) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    try:
        with open(file, "xb") as stream:
            os.chmod(file, 0o600)  # before it holds anything
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
    except OSError:
        file.unlink(missing_ok=True)
        raise


def read_key(file: Path) -> Key:
    """Return the key in ``file``, private or public.

    Raises
    ------
    ResultsError
        If there is none of Ed25519, or the package cryptography is not installed.
    """
    keys, forms = _library()
    data = read_regular(file, _MOST_KEY_BYTES, "key", error=ResultsError)
    try:
        if b"PRIVATE KEY" in data:
            key = forms.load_pem_private_key(data, None)
            private, public = key, key.public_key()
        else:
            private, public = None, forms.load_pem_public_key(data)
    except TypeError as error:  # it has a password
        remedy = f"write one without: openssl pkey -in {file} -out KEY"
        raise ResultsError(
            Finding("the key has a password, which is not asked for here", str(file), remedy=remedy)
        ) from error
    except Exception as error:  # of many classes, by what is wrong with it
        raise _no_key(file) from error
    if not isinstance(public, keys.Ed25519PublicKey):
        raise _no_key(file)
    return _key(file, private, public)


def read_private_key(file: Path, folder: Path) -> Key:
    """Return the private key in ``file``, to sign what is in ``folder`` with.

    Raises
    ------
    ResultsError
        As `read_key`; if it is a public key, lies in the folder, or others may read it.
    """
    key = read_key(file)
    if key.private is None:
        remedy = f"give the private one, such as {file.stem}" if file.suffix == _PUBLIC else "give the private one"
        raise ResultsError(Finding("this is a public key, with which nothing can be signed", str(file), remedy=remedy))
    if _lies_in(folder, file):
        what = f"the private key lies in the folder {folder}: whoever gets the results could sign others"
        raise ResultsError(Finding(what, str(file), remedy="move it elsewhere"))
    if sys.platform != "win32" and file.stat().st_mode & 0o077:
        what = "others on this machine may read the private key, or write it"
        raise ResultsError(Finding(what, str(file), remedy=f"chmod 600 {file}"))
    return key


def sign(sealed: bytes, key: Key, folder: Path) -> None:
    """Write the signature of ``sealed``, the bytes of `seal.json`, into ``folder``; OSError if it cannot be written."""
    assert key.private is not None
    with whole_file(folder / SIGNATURE, private=True) as draft:
        draft.write_bytes(key.private.sign(sealed))


def fault_of_signature(sealed: bytes, key: Key, folder: Path) -> Finding | None:
    """Return what is wrong with the signature in ``folder`` of ``sealed``, the bytes of `seal.json`; None if it fits.

    Raises
    ------
    ResultsError
        If the signature cannot be read.
    """
    file = folder / SIGNATURE
    if not os.path.lexists(file):
        return Finding("the seal is not signed", str(file), remedy=f"ask who sealed the results for {SIGNATURE}")
    signature = read_regular(file, 10 * _BYTES, "signature", error=ResultsError)
    from cryptography.exceptions import InvalidSignature

    try:
        key.public.verify(signature, sealed)
    except InvalidSignature:
        what = (
            f"the signature does not fit: the seal was changed after it was signed, or by another key than {key.name}"
        )
        return Finding(what, str(file), remedy="ask who sealed the results, on another way, for the seal and the key")
    return None


def _key(file: Path, private: Any | None, public: Any) -> Key:
    raw: bytes = public.public_bytes_raw()
    return Key(file, private, public, hashlib.sha256(raw).hexdigest()[:_FINGERPRINT])


def _no_key(file: Path) -> ResultsError:
    remedy = "make one: cyclopean seal --new-key FILE"
    return ResultsError(Finding("this is no key of Ed25519 in PEM", str(file), remedy=remedy))


def _lies_in(folder: Path, file: Path) -> bool:
    try:
        inside(folder, file, error=ResultsError)
    except ResultsError:
        return False
    return True


def _library() -> tuple[Any, Any]:
    """Return the parts of cryptography for keys of Ed25519 and for their forms in files."""
    try:
        from cryptography.hazmat.primitives import serialization
        from cryptography.hazmat.primitives.asymmetric import ed25519
    except ModuleNotFoundError as error:
        what, remedy = "signatures need the package cryptography, which is not installed", "pip install '.[sign]'"
        raise ResultsError(Finding(what, remedy=remedy)) from error
    return ed25519, serialization
