"""Files that appear with all their content or not at all."""

from __future__ import annotations

import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def whole_file(path: Path, *, keep_suffix: bool = False) -> Iterator[Path]:
    """Yield the name of a draft beside ``path`` for the body to write; at the end it takes the place of ``path``.

    Who reads ``path`` meanwhile finds what was there before, and two who write at once do not mix. If the body raises,
    ``path`` stays as it was. The folder is made if need be. The draft is named ``.NAME.TOKEN.part``; with
    ``keep_suffix`` the suffix of ``path`` follows, for writers that choose the format by it.

    Raises
    ------
    OSError
        If the draft cannot be put in place of ``path``.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    suffix = path.suffix if keep_suffix else ""
    draft = path.with_name(f".{path.name[:80]}.{secrets.token_hex(4)}.part{suffix}")
    try:
        yield draft
        draft.replace(path)
    finally:
        draft.unlink(missing_ok=True)


def write_whole(path: Path, text: str) -> None:
    """Write ``text`` to ``path`` in UTF-8, its line ends as they are, whole or not at all.

    Raises
    ------
    OSError
        If it cannot be written; what was at ``path`` is then still there.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_whole(Path(folder, "page.html"), "<p>ΔE00")
    ...     Path(folder, "page.html").read_text(encoding="utf-8")
    '<p>ΔE00'
    """
    with whole_file(path) as draft:
        draft.write_bytes(text.encode("utf-8"))
