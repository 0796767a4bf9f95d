"""The files of experiments that sessions were run with: where they usually lie, and what facts they give."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from analysis.errors import ResultsError
from analysis.records import Header, kept_experiments
from documents import InputError
from documents.yaml import YamlSource, load_document, read_yaml
from runner.protocol.shipped import shipped_folder

if TYPE_CHECKING:
    from runner.protocol.experiment import ExperimentSpec


def given_facts(header: Header, experiment: Path | None, results: Path, versions: Collection[str]) -> Mapping[str, str]:
    """Return the facts for Methods that the experiment file of a session gives, by the code of their item.

    Without ``experiment``, its file is looked for where `experiment_files` says, and must say what one of the
    ``versions`` said that the sessions were made with, by their SHA-256; of several files the first one with facts
    counts.

    Raises
    ------
    InputError
        If ``experiment`` is named, but cannot be read or is not that of the session.
    """
    if experiment is not None:
        spec, source = _read(experiment)
        if spec.name != header.experiment:
            what = f"the results are of the experiment '{header.experiment}', not of '{spec.name}'"
            raise ResultsError(source.finding(("name",), what, "name the experiment file of these sessions"))
        return spec.facts
    for file in experiment_files(header, results):
        try:
            data = read_yaml(file).data
            if not isinstance(data, dict) or "methods" not in data:  # the models, which take 0.3 s, need not be loaded
                continue
            spec, _ = _read(file)
        except InputError:  # none there, or one that is being edited: `check` says what is wrong with it
            continue
        if spec.facts and spec.name == header.experiment and spec.digest in versions:
            return spec.facts
    return {}


def _read(experiment: Path) -> tuple[ExperimentSpec, YamlSource]:
    from runner.protocol.experiment import ExperimentSpec

    return load_document(experiment, ExperimentSpec, "experiment")


def experiment_files(header: Header, results: Path) -> list[Path]:
    """Return where the file of a session's experiment usually lies, whether it is there or not.

    That is in ``experiments``, in the folder of a study that holds ``results``, in a study's folder of its name, and
    among the files that were kept beside the session.
    """
    name = Path(header.experiment).name
    usual = [root / "experiments" / f"{name}.yaml" for root in (Path.cwd(), shipped_folder())]
    around = results.resolve()
    usual += [folder / "experiment.yaml" for folder in (Path.cwd() / name, Path.cwd(), around, *around.parents[:3])]
    return list(dict.fromkeys([*usual, *kept_experiments(around, name)]))
