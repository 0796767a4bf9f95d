"""The top-level files of a BIDS dataset, and replacing an earlier export."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

from analysis.errors import ResultsError
from analysis.records import WhoAnswered
from documents import Finding
from documents.files import read_cached_json, whole_folder
from documents.text import counted
from extensions.bids.sources import Source
from extensions.bids.text import escape, write_json, write_table
from runner.reports import About

BIDS_VERSION = "1.10.0"
GENERATOR = "cyclopean"
METHODS = "methods.json"
PARTICIPANTS = {
    "participant_id": {"Description": "A code for the observer, and all that stands here of a person."},
    "simulated": {
        "Description": "Whether the observer was simulated; the tables say it of each trial.",
        "Levels": {
            "false": "a person",
            "true": "a simulated observer",
            "some": "a person and a simulated observer have this code",
        },
    },
}


def description(about: About, sources: Sequence[Source]) -> dict[str, Any]:
    """Return ``dataset_description.json``."""
    experiments = sorted({source.experiment for source in sources})
    made: dict[str, Any] = {
        "Name": about.name or ", ".join(experiments),
        "BIDSVersion": BIDS_VERSION,
        "DatasetType": "raw",
    }
    if about.license:
        made["License"] = about.license
    if about.authors:
        made["Authors"] = list(about.authors)
    ethics = dict.fromkeys(facts["ethics"] for facts in about.facts.values() if "ethics" in facts)
    if ethics:
        made["EthicsApprovals"] = list(ethics)
    return made | {
        "GeneratedBy": [
            {
                "Name": GENERATOR,
                "Version": version("cyclopean"),
                "Description": "Sessions recorded by cyclopean, exported by `cyclopean export`.",
            }
        ],
        "SourceDatasets": [{"URL": "bids::sourcedata"}],
    }


def readme(about: About, sources: Sequence[Source]) -> str:
    """Return ``README``: a description of the dataset and its files."""
    tasks = Counter((source.task, source.experiment) for source in sources)
    observers = len({source.observer for source in sources})
    simulated = sum(source.simulated for source in sources)
    unfinished = sum(not source.complete for source in sources)
    lines = [
        f"# {_line(about.name or ', '.join(sorted({source.experiment for source in sources})))}",
        "",
        "Psychophysical sessions in which observers looked at colorimetrically controlled pictures, in stereo or flat.",
        "",
        f"Participants: {observers}. Sessions: {len(sources)}, of which {simulated} were run by simulated observers "
        f"and {unfinished} were not finished.",
        "",
        "Tasks:",
        "",
        *(
            f"- `task-{task}`: the experiment {_line(name)}, {counted(count, 'session', 'sessions')}"
            for (task, name), count in tasks.items()
        ),
        "",
        *_facts_lines(about.facts),
        "## Where things are",
        "",
        "- `sub-*/ses-*/beh/*_beh.tsv`: one row per trial that counts, in the order in which they were first answered.",
        "- `task-*_beh.json`: what each column means. The same columns stand in every table of a task.",
        "- `sub-*/ses-*/beh/*_beh.json`: how the session was made: display, stereo mode, glasses, distance, stimuli,",
        "  software, and the SHA-256 of what decided on it.",
        "- `sub-*/ses-*/beh/*_events.tsv`, where there is any: answers that a later attempt replaced, marks, notes,",
        "  resumptions.",
        "- `sourcedata/*/methods.json`, where there is any: what the experimenters said for Methods.",
        "- `sourcedata/`: the sessions as they were recorded, byte for byte, and the files that they were made with.",
        "",
        "Words that people wrote have tabs, line ends and invisible characters escaped as in JSON (`\\t`, `\\n`, "
        "`\\u202e`).",
        "",
    ]
    return "\n".join(lines)


def _facts_lines(facts: Mapping[str, Mapping[str, str]]) -> list[str]:
    """Return what the experimenters said of each experiment, as a section of ``README``; nothing where they did not."""
    lines = ["## What the experimenters say", ""] if any(facts.values()) else []
    for experiment, given in facts.items():
        if given:
            lines += [f"{_line(experiment)}:", "", *(f"- {code}: {_line(text)}" for code, text in given.items()), ""]
    return lines


def changes(before: str | None, sources: Sequence[Source]) -> str:
    """Return ``CHANGES``: an entry for this export on top of those of earlier exports into the same folder."""
    latest = re.match(r"1\.(\d+)\.0 ", before or "")
    number = int(latest[1]) + 1 if latest else 0
    observers = len({source.observer for source in sources})
    entry = (
        f"1.{number}.0 {datetime.now(UTC).date().isoformat()}\n"
        f"  - {counted(len(sources), 'session', 'sessions')} of "
        f"{counted(observers, 'participant', 'participants')}, exported by cyclopean {version('cyclopean')}.\n"
    )
    return f"{entry}\n{before}" if before else entry


def write_dataset_files(folder: Path, about: About, sources: Sequence[Source], changes_before: str | None) -> None:
    """Write description, README, CHANGES and participants into ``folder``."""
    write_json(folder / "dataset_description.json", description(about, sources))
    (folder / "README").write_text(readme(about, sources), encoding="utf-8", newline="\n")
    (folder / "CHANGES").write_text(changes(changes_before, sources), encoding="utf-8", newline="\n")
    for task, experiment in {source.task: source.experiment for source in sources}.items():
        if about.facts.get(experiment):
            write_json(folder / "sourcedata" / task / METHODS, dict(about.facts[experiment]))
    labels = sorted({source.observer for source in sources})
    who = WhoAnswered.of((source.observer, source.simulated) for source in sources)
    rows = ((f"sub-{label}", _simulated(who, label)) for label in labels)
    write_table(folder / "participants.tsv", ("participant_id", "simulated"), rows)
    write_json(folder / "participants.json", PARTICIPANTS)


def _simulated(who: WhoAnswered, label: str) -> str:
    if label in who.shared:
        return "some"
    return "true" if label in who.simulated else "false"


def _line(text: str) -> str:
    """Return text from people as one line of plain Markdown."""
    return re.sub(r"([`*_<>\[\]#|&])", r"\\\1", escape(text))


_OURS = re.compile(
    r"dataset_description\.json|README|CHANGES|participants\.(tsv|json)|task-[^/]+_(beh|events)\.json"
    r"|sub-[^/]+/ses-[^/]+/beh/sub-[^/]+_ses-[^/]+_task-[^/]+_(beh|events)\.(tsv|json)"
    r"|sourcedata/[^/]+/sub-[^/]+/ses-[^/]+/session\.jsonl"
    r"|sourcedata/[^/]+/configuration/[0-9a-f]{16}/.+|sourcedata/[^/]+/methods\.json"
)
# Files that file managers add to folders.
_LITTER = frozenset({".DS_Store", "Thumbs.db", "desktop.ini"})


def check_replaceable(folder: Path) -> None:
    """Check that ``folder`` does not exist, is empty, or has an export and nothing else.

    Raises
    ------
    ResultsError
        Otherwise: other files are never overwritten.
    """
    if not folder.exists():
        return
    if not folder.is_dir():
        raise ResultsError(Finding("this is a file", str(folder), remedy="name a folder"))
    if not any(folder.iterdir()):
        return
    if not _is_export(folder):
        raise ResultsError(
            Finding("this folder has files that are not an export", str(folder), remedy="name a new or empty folder")
        )
    inside = (path for path in folder.rglob("*") if path.name not in _LITTER and (path.is_symlink() or path.is_file()))
    names_inside = sorted(path.relative_to(folder).as_posix() for path in inside)
    foreign = [name for name in names_inside if not _OURS.fullmatch(name)]
    if foreign:
        names = ", ".join(foreign[:5])
        raise ResultsError(
            Finding(
                f"files were added to this export: {names}",
                str(folder),
                remedy="move them elsewhere, or name a new folder",
            )
        )


def _is_export(folder: Path) -> bool:
    try:
        made = read_cached_json(folder / "dataset_description.json")
        return bool(made["GeneratedBy"][0]["Name"] == GENERATOR)
    except (KeyError, IndexError, TypeError):
        return False


@contextmanager
def replacing(folder: Path) -> Iterator[Path]:
    """Yield a new folder beside ``folder`` that replaces it on success, and is removed otherwise."""
    with whole_folder(folder, replace=True, private=True) as part:
        yield part
        check_replaceable(folder)
