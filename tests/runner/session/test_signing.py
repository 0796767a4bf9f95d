"""A seal that is signed tells forgers from who has the key."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

from analysis.records import session_files
from cyclopean import verify
from runner.session import seal_results
from tests.choice import nightly

needs_cryptography = pytest.mark.skipif(
    find_spec("cryptography") is None, reason="cryptography is not installed (pip install '.[sign]')"
)
Command = Callable[..., Any]  # tests/conftest.py


@pytest.fixture
def key(tmp_path: Path, cyclopean: Command) -> Path:
    file = tmp_path / "keys" / "paints"
    cyclopean("seal", "--new-key", file)
    return file


@pytest.fixture
def public(key: Path) -> Path:
    return key.with_name("paints.pub")


def _forge(results: Path) -> None:
    """Exchange an answer, and compute the checksums of the log again, as a forger would."""
    from documents.files.chain import EMPTY, sealed

    file = min(session_files(results))
    lines = [json.loads(line) for line in file.read_bytes().splitlines()]
    digest, made = EMPTY, []
    for number, line in enumerate(lines, 1):
        del line["line"], line["chain"]
        if "remarks" in line:
            line["remarks"] = ["forged"]
        data, digest = sealed(line, number, digest)
        made.append(data + b"\n")
    file.write_bytes(b"".join(made))


@needs_cryptography
def test_what_is_signed_and_untouched_passes(results: Path, key: Path, public: Path, cyclopean: Command) -> None:
    told = cyclopean("seal", results, "--key", key).stdout
    assert str(results / "seal.sig") in told
    assert len((results / "seal.sig").read_bytes()) == 64
    assert "seal.sig" not in json.loads((results / "seal.json").read_text())["files"]
    for given in (key, public):
        told = cyclopean("verify", results, "--key", given)
        assert "signed by the key" in told.stdout
        assert told.stderr == ""
    (seal,) = json.loads(cyclopean("verify", results, "--key", public, "--json").stdout)["seals"]
    assert seal["signed"] is True
    assert len(seal["signed_by"]) == 16
    assert "signed, not checked" in cyclopean("verify", results).stdout
    if shutil.which("openssl"):
        command = ["openssl", "pkeyutl", "-verify", "-pubin", "-inkey", str(public), "-rawin"]
        command += ["-in", str(results / "seal.json"), "-sigfile", str(results / "seal.sig")]
        assert subprocess.run(command, check=False, capture_output=True).returncode == 0


@needs_cryptography
def test_python_finds_what_the_command_finds(results: Path, key: Path, public: Path, cyclopean: Command) -> None:
    """With the key and without it; a seal that cannot be read is a row too."""
    cyclopean("seal", results, "--key", key)
    whole = verify(results, key=public)
    assert list(whole["kind"]) == ["session", "session", "seal"]
    assert list(whole["findings"]) == [[], [], []]
    assert whole["signature"].iloc[-1].startswith("signed by the key")
    (results / "seal.sig").unlink()
    assert not any(verify(results)["findings"])
    _change_a_file(results, key)
    (results / "small" / "seal.json").write_text("{")  # cannot be read
    for given in (None, public):
        table = verify(results, key=given)
        words = () if given is None else ("--key", given)
        found = json.loads(cyclopean("verify", results, *words, "--json", expect=1).stdout)["findings"]
        told = [(finding["file"], finding["message"]) for finding in found]
        assert str(results / "small" / "seal.json") in set(table["file"])
        of_rows = [words for row in table["findings"] for words in row]
        assert len(of_rows) == len(told)
        assert all(any(file in words and message in words for words in of_rows) for file, message in told)


def _change_a_file(results: Path, key: Path) -> None:
    next(results.rglob("recipe.yaml")).write_text("changed")


def _seal_again(results: Path, key: Path) -> None:
    """Forge the log, and write a seal that fits it; the signature stays."""
    signature = (results / "seal.sig").read_bytes()
    _forge(results)
    (results / "seal.sig").unlink()
    seal_results(results, replace=True)
    (results / "seal.sig").write_bytes(signature)


def _sign_by_another_key(results: Path, key: Path) -> None:
    from analysis.seals import new_key

    new_key(key.with_name("forger"))
    _forge(results)
    seal_results(results, replace=True, key=key.with_name("forger"))


def _remove_the_signature(results: Path, key: Path) -> None:
    (results / "seal.sig").unlink()


def _remove_the_seal(results: Path, key: Path) -> None:
    _forge(results)
    (results / "seal.sig").unlink()
    (results / "seal.json").unlink()


def _cut_the_signature(results: Path, key: Path) -> None:
    (results / "seal.sig").write_bytes((results / "seal.sig").read_bytes()[:-1])


def _flip_a_bit_of_the_seal(results: Path, key: Path) -> None:
    text = (results / "seal.json").read_text()
    (results / "seal.json").write_text(text.replace('"sessions": 2', '"sessions": 3'))


def _add_a_session(results: Path, key: Path) -> None:
    file = min(session_files(results))
    other = file.parent.with_name("ses-20200101T000000abcdefghij")
    other.mkdir()
    shutil.copy(file, other)


@needs_cryptography
@pytest.mark.parametrize(
    ("forge", "fault_in"),
    [
        (_change_a_file, "recipe.yaml"),
        (_seal_again, "seal.sig"),
        (_sign_by_another_key, "seal.sig"),
        *nightly(
            (_remove_the_signature, "seal.sig"),
            (_remove_the_seal, "session.jsonl"),
            (_cut_the_signature, "seal.sig"),
            (_flip_a_bit_of_the_seal, "seal.sig"),
        ),
        (_add_a_session, "session.jsonl"),
    ],
)
def test_what_was_forged_is_found(
    results: Path, key: Path, public: Path, cyclopean: Command, forge: Callable[[Path, Path], None], fault_in: str
) -> None:
    cyclopean("seal", results, "--key", key)
    forge(results, key)
    found = json.loads(cyclopean("verify", results, "--key", public, "--json", expect=1).stdout)["findings"]
    assert fault_in in {Path(finding["file"]).name for finding in found}


@needs_cryptography
def test_a_forger_who_seals_again_is_found_by_the_key_alone(
    results: Path, key: Path, public: Path, cyclopean: Command
) -> None:
    cyclopean("seal", results, "--key", key)
    _sign_by_another_key(results, key)
    cyclopean("verify", results)
    cyclopean("verify", results, "--key", public, expect=1)
    cyclopean("verify", results, "--key", key.with_name("forger.pub"))


@needs_cryptography
def test_a_log_that_no_signed_seal_names_is_found(
    results: Path, recorded: Path, key: Path, public: Path, cyclopean: Command
) -> None:
    cyclopean("seal", results, "--key", key)
    shutil.copytree(recorded, results.with_name("unsealed"))
    cyclopean("verify", results, results.with_name("unsealed"), expect=0)
    found = json.loads(
        cyclopean("verify", results, results.with_name("unsealed"), "--key", public, "--json", expect=1).stdout
    )["findings"]
    assert [Path(finding["file"]) for finding in found] == list(session_files(results.with_name("unsealed")))


@needs_cryptography
def test_a_signature_is_not_lost_by_sealing_again(results: Path, key: Path, public: Path, cyclopean: Command) -> None:
    cyclopean("seal", results, "--key", key)
    assert "--key" in cyclopean("seal", results, "--replace", expect=2).stderr
    cyclopean("verify", results, "--key", public)
    (results / "notes.txt").write_text("a later note")
    cyclopean("verify", results, "--key", public, expect=1)
    cyclopean("seal", results, "--replace", "--key", key)
    cyclopean("verify", results, "--key", public)


@needs_cryptography
@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such modes")
def test_a_private_key_is_for_its_owner(results: Path, key: Path, public: Path, cyclopean: Command) -> None:
    assert key.stat().st_mode & 0o777 == 0o600
    before = key.read_bytes()
    cyclopean("seal", "--new-key", key, expect=2)
    assert key.read_bytes() == before
    key.chmod(0o640)
    assert "chmod 600" in cyclopean("seal", results, "--key", key, expect=2).stderr
    cyclopean("verify", results, "--key", key, expect=1)  # not signed; to check, any key will do
    assert not (results / "seal.json").exists()


@needs_cryptography
def test_keys_that_cannot_sign_are_refused_before_anything_is_written(
    results: Path, key: Path, public: Path, cyclopean: Command
) -> None:
    shutil.copy(key, results / "key")
    words = results / "words.txt"
    words.write_text("-----BEGIN PRIVATE KEY-----\nnothing\n")
    for wrong in (public, results / "key", words, results / "nowhere", results):
        told = cyclopean("seal", results, "--key", wrong, expect=2).stderr
        assert str(wrong) in told
        assert len(told.splitlines()) == 1
    assert not (results / "seal.json").exists()
    for wrong in (words, results / "nowhere"):
        assert str(wrong) in cyclopean("verify", results, "--key", wrong, expect=2).stderr
    for more in ((results,), ("--replace",), ("--key", key)):
        cyclopean("seal", "--new-key", key.with_name("other"), *more, expect=2)
    cyclopean("seal", expect=2)


def test_without_the_package_it_is_said_what_to_install(
    results: Path, tmp_path: Path, cyclopean: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in [name for name in sys.modules if name.split(".")[0] == "cryptography"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "cryptography", None)
    (tmp_path / "key").write_text("x")
    for command in (
        ("seal", "--new-key", tmp_path / "new"),
        ("seal", results, "--key", tmp_path / "key"),
        ("verify", results, "--key", tmp_path / "key"),
    ):
        assert "pip install '.[sign]'" in cyclopean(*command, expect=2).stderr, command
    cyclopean("seal", results)  # which needs none
    assert "not signed" in cyclopean("verify", results).stdout
