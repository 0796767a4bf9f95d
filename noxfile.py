"""The targets of the Makefile for machines without make: `pipx install nox`, then `nox -s demo`, `nox -s test`.

`nox -l` lists them. Options after `--` go to the last command: `nox -s test -- tests/analysis`.
"""

import nox

nox.options.sessions = ["check", "test"]
nox.options.reuse_existing_virtualenvs = True

# Each worker of the tests computes in one thread: more of them only wait for each other.
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")


def _install(session: nox.Session, *more: str) -> None:
    """Install the pinned packages, whose hashes pip checks, and this checkout, unless nox runs with --no-venv."""
    if not isinstance(session.virtualenv, nox.virtualenv.PassthroughEnv):
        files = [word for name in ("dev", *more) for word in ("-r", f"requirements/{name}.txt")]
        session.install("--require-hashes", "--no-deps", *files)
        session.install("--no-deps", "--no-build-isolation", "--no-index", "-e", ".")


@nox.session
def demo(session: nox.Session) -> None:
    """Build stimuli, run 30 simulated observers, write a report."""
    _install(session)
    session.run("python", "-m", "cyclopean", "demo", *session.posargs)


@nox.session
def test(session: nox.Session) -> None:
    """Run the tests."""
    _install(session)
    arguments = session.posargs or ["-n", "auto", "--share"]
    session.run("python", "-m", "pytest", *arguments, env=ONE_THREAD)


@nox.session
def check(session: nox.Session) -> None:
    """Floors, lint, format, types."""
    _install(session)
    session.run("ruff", "check", ".")
    session.run("ruff", "format", "--check", ".")
    session.run("mypy")
    session.run("mypy", "--namespace-packages", "--explicit-package-bases", "tests")
    session.run("lint-imports")
    session.run("cyclopean", "--help", env={"EAGER_IMPORT": "1"}, silent=True)
    session.run("python", "tools/count_rooms.py", "--check")
    session.run("python", "tools/api_page.py", "--check")


@nox.session
def docs(session: nox.Session) -> None:
    """The pages of docs/ as a site with search, into site/."""
    _install(session)
    session.run("python", "-m", "mkdocs", "build", "--strict", env={"NO_MKDOCS_2_WARNING": "1"})


@nox.session
def nightly(session: nox.Session) -> None:
    """What takes long or repeats, and the sweeps to the edges."""
    _install(session)
    session.run("python", "tools/stress.py", "--nightly")


@nox.session
def stress(session: nox.Session) -> None:
    """Slow sweeps to the edges."""
    _install(session)
    session.run("python", "tools/stress.py", *session.posargs)


@nox.session
def bench(session: nox.Session) -> None:
    """Run time against error, peers beside; ends with what is promised and kept, in benchmarks/out."""
    _install(session, "bench")
    session.run("python", "benchmarks/run_all.py", *session.posargs)
