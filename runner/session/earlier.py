"""Whether a session is made with what the earlier ones in its folder of results were made with."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from analysis.errors import ResultsError
from analysis.records import FILE_NAME, Changes, SessionLog, Version, read_session
from documents import Finding
from runner.protocol import Experiment
from runner.session.configuration import Configuration, configuration_of
from runner.session.folders import answered
from runner.session.header import hashes, station
from stimuli.build import StimulusSet

_SECOND = len("ses-20260314T120000")
_OF_STATION = ("display", "rig")
REMEDY = (
    "restore the files, or choose another folder with --results, or give --accept-changes, which the record then states"
)


def version_now(experiment: Experiment, stimuli: StimulusSet, configuration: Configuration) -> Version:
    """Return what a session that began now would be made with."""
    return Version.of_lists(hashes(experiment, stimuli), configuration.named, stimuli.manifest)


@dataclass(frozen=True, slots=True)
class ChangedSince:
    """What is another than in an earlier session, whose ``log`` is the latest to compare with."""

    changes: Changes
    log: SessionLog

    @property
    def words(self) -> str:
        """What changed since whose session, and which files."""
        header = self.log.header
        since = f"since observer {header.observer}'s session of {header.started_utc[:16].replace('T', ' ')} UTC"
        return f"{self.changes.subject} changed {since}{self.changes.names}"

    @property
    def finding(self) -> Finding:
        """The same with the log and what to do."""
        return Finding(self.words, str(self.log.file), remedy=REMEDY)


def changed_since_earlier(
    experiment: Experiment, stimuli: StimulusSet, results: Path, unread: Callable[[Finding], None], *, simulated: bool
) -> tuple[ChangedSince, ...]:
    """Return what is another than in the latest session in the same stereo mode that anything was answered in.

    Sessions of people are compared with such, and simulated ones with simulated ones. Display and rig are compared with
    the latest session of this station, if it has one: each station has its own. ``unread`` is called for each log that
    would be compared and cannot be read.
    """
    now = version_now(experiment, stimuli, configuration_of(experiment, stimuli))
    here = "" if simulated else station()
    found: list[ChangedSince] = []
    latest = True
    for log in _latest_first(results / experiment.spec.name, unread):
        header = log.header
        if header.simulated != simulated or header.display.mode != experiment.rig.mode or not answered(log):
            continue
        before = Version.of_log(log)
        own = not here or not header.station or header.station == here
        kept = {
            name: digest
            for name, digest in before.hashes.items()
            if (name in _OF_STATION and own) or (name not in _OF_STATION and latest)
        }
        changes = now.changes_since(Version(kept, before.files, before.own, before.pictures))
        if changes:
            found.append(ChangedSince(changes, log))
        latest = False
        if own:
            break
    return tuple(found)


def _latest_first(folder: Path, unread: Callable[[Finding], None]) -> Iterator[SessionLog]:
    """Yield the logs of an experiment's folder, the session that began last first; its name begins with the time."""
    files = list(folder.glob(f"sub-*/ses-*/{FILE_NAME}"))
    for file in sorted(files, key=lambda file: (file.parent.name[:_SECOND], _written_ns(file)), reverse=True):
        try:
            yield read_session(file)
        except ResultsError as error:
            what = f"this earlier session is not compared, its log cannot be read: {error.findings[0].message}"
            unread(replace(error.findings[0], message=what))


def _written_ns(file: Path) -> int:
    """Return when ``file`` was written last, which parts sessions that began in one second."""
    try:
        return file.stat().st_mtime_ns
    except OSError:
        return 0
