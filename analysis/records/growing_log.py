"""A session's log that another process may be writing: read on from where it was read to."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path

from analysis.errors import ResultsError
from analysis.kinds.trial import Trial
from analysis.records.lines import Header
from analysis.records.session_record import RecordReader, refusal
from documents import count_work
from documents.files import MOST_LOG_BYTES, ChainReader, DamagedLineError, open_regular, read_lines, unreadable

_AT_ONCE = 1 << 18  # bytes: some six hundred trials


@dataclass(slots=True)
class GrowingLog:
    """A log that may grow; each `read` takes the whole lines that were added since the last one.

    Lines have the same checks as in `read_session`. A last line without its line end is taken once it is whole. A file
    that is shorter than what was read of it is read anew, from its beginning.

    Examples
    --------
    >>> import json
    >>> import tempfile
    >>> from analysis.records import new_header
    >>> header = new_header("views", "01", "s1", "2026-01-31T09:30:00Z", seed=1)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "session.jsonl")
    ...     _ = file.write_text(json.dumps(header.to_json()))  # without its line end
    ...     log = GrowingLog(file)
    ...     before = log.read(), log.header
    ...     _ = file.write_text(json.dumps(header.to_json()) + "\\n")
    ...     after = log.read(), log.header.observer
    >>> before, after
    (((), None), ((), '01'))
    """

    file: Path
    restarts: int = 0
    """How often the file was read anew: what was returned before is then void."""
    _version: tuple[int, int] = (0, 0)
    _size: int = 0  # of what was taken
    _unfinished: int = 0  # bytes that were read after that
    _chain: ChainReader = field(default_factory=ChainReader)
    _reader: RecordReader = field(default_factory=RecordReader)

    @property
    def header(self) -> Header | None:
        """The header, None as long as it is not there whole."""
        return self._reader.header

    @property
    def is_read(self) -> bool:
        """Whether all was read that was there when it was looked at last."""
        return self._size + self._unfinished >= self._version[1]

    def read(self) -> tuple[Trial, ...]:
        """Return the answers that were added, of 256 kB or one line at most; call again until `is_read`.

        Raises
        ------
        FileNotFoundError
            If the file is gone.
        ResultsError
            If it is unreadable, or a line is no record or was changed.
        """
        try:
            facts = os.stat(self.file)
            version = facts.st_mtime_ns, facts.st_size
            if version == self._version and self.is_read:
                return ()
            if facts.st_size < self._size:
                self._size, self._chain, self._reader = 0, ChainReader(), RecordReader()
                self.restarts += 1
            with open_regular(self.file, "log", limit_bytes=MOST_LOG_BYTES, error=ResultsError) as stream:
                stream.seek(self._size)
                data = stream.read(_AT_ONCE)
                while len(data) % _AT_ONCE == 0 and b"\n" not in data and (more := stream.read(_AT_ONCE)):
                    data += more
            lines = data[: data.rfind(b"\n") + 1]
            read_lines(BytesIO(lines), self._reader.take, on_checksum=self._reader.fits, chain=self._chain)
        except FileNotFoundError:
            raise
        except OSError as error:
            raise ResultsError(unreadable(error, self.file, "results")) from error
        except DamagedLineError as error:
            raise ResultsError(refusal(error, self.file)) from error
        self._version, self._size, self._unfinished = version, self._size + len(lines), len(data) - len(lines)
        answers = tuple(record for record in self._reader.records if isinstance(record, Trial))
        self._reader.records.clear()
        self._reader.windows.clear()
        self._reader.pooled.clear()
        count_work("trials_read", len(answers))
        return answers
