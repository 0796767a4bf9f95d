"""What other packages add: kinds by name, from entry points, loaded when a file or a command names them.

A package offers a kind in the ``pyproject.toml`` of its own, as an entry point of one of our groups::

    [project.entry-points."cyclopean.blocks"]
    same_or_different = "same_or_different.block:SameOrDifferent"

and says in its ``__init__.py`` for which interface it was written: ``CYCLOPEAN_INTERFACE = 1``. A `Registry` holds the
kinds of one group: our own, and those. An environment is looked through, which takes a tenth of a second, for a name
that is not known yet and by what lists all; what was found is kept in the user's cache until packages change.
"""

from __future__ import annotations

import hashlib
import importlib
import json
import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext, redirect_stdout, suppress
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, get_args

from documents.files.atomic import write_whole
from documents.files.cached_json import read_cached_json
from documents.findings import Finding, InputError, WorkError, shortened
from documents.platform import user_folder
from documents.text import did_you_mean, visible

if TYPE_CHECKING:
    from pydantic import BaseModel

INTERFACE = 1
"""The version of the interface: it rises when what extensions stand on changes so that old ones would fail."""

OWN = "cyclopean"
_DECLARED = "CYCLOPEAN_INTERFACE"
_SHOWN = 80  # letters of a name

Kind = TypeVar("Kind")


@dataclass(frozen=True, slots=True)
class Offer:
    """What a package offers: a ``name`` in a ``group``, at ``module:attribute`` or ``package:file.yaml``."""

    group: str
    name: str
    target: str
    package: str
    version: str

    def __str__(self) -> str:
        return visible(shortened(f"{self.package} {self.version}".strip(), _SHOWN))

    @property
    def shown(self) -> str:
        """The name, as people read it."""
        return visible(shortened(self.name, _SHOWN))


class ExtensionError(InputError):
    """An extension that cannot be used: it does not load, is of another interface, or claims a name that is taken."""

    def __init__(self, offer: Offer, what: str, remedy: str | None = None) -> None:
        self.offer, self.reason = offer, visible(shortened(what))
        message = f"the extension {offer} cannot give '{offer.shown}' ({offer.group}): {self.reason}"
        mend = "install cyclopean again" if offer.package == OWN else f"leave it out: pip uninstall {offer.package}"
        remedy = remedy or f"mend it, or {mend}"
        super().__init__(Finding(message, remedy=remedy, code="extension"))


class Environment:
    """What the packages of an environment offer: what is in the cache, and, for a name that is not there, all there is.

    Parameters
    ----------
    path
        The folders that packages are looked for in; those of Python unless they are given.
    """

    def __init__(self, path: Sequence[str] | None = None) -> None:
        self._path = path

    @cached_property
    def _file(self) -> Path:
        folders = sys.path if self._path is None else self._path
        where = hashlib.sha256("\0".join([sys.prefix, __file__, *folders]).encode()).hexdigest()[:16]
        return user_folder("cache") / OWN / f"extensions-{where}.json"

    @cached_property
    def _held(self) -> tuple[str, tuple[Offer, ...]]:
        """What the cache says: the packages that it was made from, as `_packages` has them, and what they offer."""
        with suppress(TypeError, KeyError):
            held = read_cached_json(self._file)
            return held["packages"], tuple(Offer(**each) for each in held["offers"])
        return "", ()

    @cached_property
    def _scanned(self) -> tuple[Offer, ...]:
        packages, offers = self._held
        return offers if packages == self._packages() else self.scan()

    def _packages(self) -> str:
        """Return a digest of which packages lie where, and of when was written what they offer."""
        found: list[tuple[object, ...]] = []
        for folder in sys.path if self._path is None else self._path:
            with suppress(OSError):
                lying = (each for each in os.scandir(folder or ".") if each.name.endswith((".dist-info", ".egg-info")))
                found += sorted((folder, each.name, *_written(each.path)) for each in lying)
        return hashlib.sha256(repr(found).encode()).hexdigest()

    def scan(self) -> tuple[Offer, ...]:
        """Look through the environment, and keep what was found."""
        from importlib.metadata import distributions

        packages = self._packages()
        offers: dict[str, list[Offer]] = {}
        for each in distributions() if self._path is None else distributions(path=list(self._path)):
            with suppress(Exception):  # a package whose own files are broken is nobody's extension
                points = [point for point in each.entry_points if point.group.startswith(f"{OWN}.")]
                package, version = (str(each.metadata[key] or "") for key in ("Name", "Version"))
                given = [Offer(point.group, point.name, point.value, package, version) for point in points]
                if package:  # nobody could say which to leave out
                    offers.setdefault(package, given)  # the first one of a name is the one that is imported
        found = tuple(offer for _, given in sorted(offers.items()) for offer in given)
        if (packages, found) != self._held:
            self._held = packages, found
            with suppress(OSError, InputError):
                self._file.parent.mkdir(parents=True, exist_ok=True)
                held = {"packages": packages, "offers": [asdict(offer) for offer in found]}
                write_whole(self._file, json.dumps(held))
        self._scanned = found
        return found

    def all(self, group: str) -> list[Offer]:
        """Return the offers of a group."""
        return [offer for offer in self._scanned if offer.group == group]

    def named(self, group: str, name: str) -> list[Offer]:
        """Return the offers of a name; from the cache where it is there."""

        def of(offers: tuple[Offer, ...]) -> list[Offer]:
            return [offer for offer in offers if (offer.group, offer.name) == (group, name)]

        return of(self._held[1]) or of(self._scanned)

    def again(self, offer: Offer) -> Offer | None:
        """Return what offers the same name now, the cache being out of date; None where nothing does."""
        if "_scanned" not in vars(self):
            self.scan()
        return next(iter(self.named(offer.group, offer.name)), None)


def _written(folder: str) -> tuple[int, ...]:
    """Return when a package's entry points were written, in nanoseconds, and their bytes; nothing without them."""
    try:
        found = os.stat(os.path.join(folder, "entry_points.txt"))
    except OSError:
        return ()
    return found.st_mtime_ns, found.st_size


ENVIRONMENT = Environment()


class Registry(Mapping[str, Kind]):
    """The kinds of one group by name: our own, and those that other packages offer.

    A name is looked up as in any mapping; one that is not known yet is looked for in the environment. To go through it
    is to go through the core's and those that were asked for: `names` looks for all. Our own are the core's, and those
    that our distribution has entry points for; where another package offers such a name too, ours is used.

    Parameters
    ----------
    group
        The group of entry points, such as ``cyclopean.blocks``.
    own
        Where each of the core's kinds is, ``module:attribute``, by name; loaded when it is asked for.
    fits
        Says what is wrong with a kind of a name that an extension offers; None where nothing is.
    environment
        Where other packages are; that of this program unless it is given.
    """

    def __init__(
        self,
        group: str,
        own: Mapping[str, str],
        fits: Callable[[str, Any], str | None],
        environment: Environment | None = None,
    ) -> None:
        self.group, self._own, self._fits = group, dict(own), fits
        self._environment = environment or ENVIRONMENT
        self._loaded: dict[str, Kind] = {}

    def own(self) -> tuple[str, ...]:
        """Return the names of our own kinds, the core's first; looks through the environment."""
        shipped = (offer.name for offer in self._environment.all(self.group) if offer.package == OWN)
        return tuple(dict.fromkeys([*self._own, *shipped]))

    def names(self) -> tuple[str, ...]:
        """Return all names, our own first; looks through the environment. What cannot be used is left out."""
        usable = []
        for name in self.every()[len(self._own) :]:
            with suppress(ExtensionError):
                usable += [name] if self[name] is not None else []
        return (*self._own, *usable)

    def every(self) -> tuple[str, ...]:
        """Return all names as `names` does, with those that cannot be used: what asks each says so of them."""
        offered = {offer.name for offer in self._environment.all(self.group)}
        return (*self._own, *sorted(offered - set(self._own)))

    def __getitem__(self, name: str) -> Kind:
        """Return the kind of that name, loaded.

        Raises
        ------
        KeyError
            If nobody offers it.
        ExtensionError
            If who offers it cannot be used, or several do.
        """
        if name not in self._loaded:
            if name in self._own:
                self._loaded[name] = _attribute(self._own[name])
            elif offer := self._offered(name):
                self._loaded[name] = self._load(offer)
        return self._loaded[name]

    def __iter__(self) -> Iterator[str]:
        return iter({**self._own, **self._loaded})

    def __len__(self) -> int:
        return len({**self._own, **self._loaded})

    def offer(self, name: str) -> Offer | None:
        """Return who offers a name that is not our own; None where nobody does.

        Raises
        ------
        ExtensionError
            If several packages offer it.
        """
        offer = None if name in self._own else self._offered(name)
        return None if offer is None or offer.package == OWN else offer

    def whose(self, name: str) -> str:
        """Return the package and its version that offer a name which is not our own; empty where it is ours."""
        offer = self.offer(name)
        return "" if offer is None else f"{offer.package} {version_of(offer)}"

    def wanted(self, name: str, what: str, error: type[InputError] = InputError) -> Kind:
        """Return the kind of a name that a person typed, such as that of a ``listener``, which ``what`` calls it.

        Raises
        ------
        InputError
            If nobody offers it, then an ``error``, or who does cannot be used.
        """
        kind = self.get(name)
        if kind is None:
            names = self.names()
            remedy = did_you_mean(name, names) if names else f"install a package that adds to {self.group}"
            raise error(Finding(f"there is no {what} '{name}'", remedy=remedy))
        return kind

    @contextmanager
    def blamed(self, name: str) -> Iterator[None]:
        """Name the package of a kind that raises no error of ours; what a kind of ours raises stays as it is.

        Raises
        ------
        ExtensionError
            In place of what another package's kind of that name raised.
        """
        try:
            yield
        except Exception as error:
            if isinstance(error, InputError | WorkError) or not (offer := self.offer(name)):
                raise
            now = replace(offer, version=version_of(offer))
            raise ExtensionError(now, f"it raised {_said(error)}") from error

    @contextmanager
    def trying(self, name: str, kind: Kind | None) -> Iterator[None]:
        """Have a kind by a name that no package offers yet, as a proof of it needs; None takes what is offered."""
        before = self._loaded
        self._loaded = before if kind is None else {**before, name: kind}
        try:
            yield
        finally:
            self._loaded = before

    def problems(self) -> Iterator[ExtensionError]:
        """Yield what is wrong with each name that is offered in the environment, also where it is one of ours."""
        own = self.own()
        for offer in self._environment.all(self.group):
            try:
                if offer.name in own and offer.package != OWN:
                    raise ExtensionError(offer, "cyclopean has a kind of that name itself, which is used")
                self[offer.name]
            except ExtensionError as problem:
                yield problem if problem.offer.package == offer.package else _taken(offer, problem.offer)

    def _offered(self, name: str) -> Offer | None:
        offers = self._environment.named(self.group, name)
        offers = [offer for offer in offers if offer.package == OWN] or offers
        if len(offers) > 1:
            raise _taken(*offers[:2])
        return offers[0] if offers else None

    def _load(self, offer: Offer) -> Kind:
        module, _, attribute = offer.target.partition(":")
        try:
            # What a package prints is no part of what ours does; one that ends the program ends nothing.
            with nullcontext() if offer.package == OWN else redirect_stdout(sys.stderr):
                kind: Kind = _attribute(offer.target)
        except (Exception, SystemExit) as error:
            # What is out of date in the cache is looked up again, once.
            if (now := self._environment.again(offer)) != offer:
                if now is None:
                    raise ExtensionError(offer, "it is not installed any more") from None
                return self._load(now)
            raise ExtensionError(offer, f"{module} does not load ({_said(error)})") from error
        if offer.package != OWN:
            declared = getattr(sys.modules.get(module.partition(".")[0]), _DECLARED, None)
            if declared != INTERFACE:
                raise ExtensionError(offer, *_other_interface(module.partition(".")[0], declared))
        try:
            wrong = self._fits(offer.name, kind)
        except Exception as error:
            wrong = f"cannot be looked at ({_said(error)})"
        if wrong:
            raise ExtensionError(offer, f"{attribute} of {module} {wrong}")
        return kind


def of_base(base: type[BaseModel]) -> Callable[[str, Any], str | None]:
    """Return what says whether a kind is a model of ``base`` whose key ``kind`` is the name that it is offered by."""

    def wrong(name: str, kind: Any) -> str | None:
        if not (isinstance(kind, type) and issubclass(kind, base)):
            return f"is no {base.__name__}"
        own = get_args(kind.model_fields["kind"].annotation)
        return None if own == (name,) else f"names its kind {' or '.join(map(str, own)) or 'nothing'}, not {name}"

    return wrong


def installed() -> tuple[Offer, ...]:
    """Return what other packages of this environment offer, looked through anew."""
    return tuple(offer for offer in ENVIRONMENT.scan() if offer.package != OWN)


def version_of(offer: Offer) -> str:
    """Return the version that is installed now; the cache's may be that of before an upgrade."""
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version(offer.package)
    except PackageNotFoundError:
        return offer.version


def _taken(offer: Offer, other: Offer) -> ExtensionError:
    return ExtensionError(offer, f"{other} offers the same name", f"pip uninstall {other.package}")


def _said(error: BaseException) -> str:
    return f"{type(error).__name__}: {error}" if str(error) else type(error).__name__


def _other_interface(package: str, declared: object) -> tuple[str, str]:
    if declared is None:
        return f"{package} does not say for which interface it was written", f"add {_DECLARED} = {INTERFACE} to it"
    newer = isinstance(declared, int) and declared > INTERFACE
    remedy = "install a newer cyclopean" if newer else f"install a version of it for interface {INTERFACE}"
    return f"it was written for interface {declared}, and this is {INTERFACE}", remedy


def _attribute(target: str) -> Any:
    """Return what a target names: an attribute of a module, or the path of a data file beside it."""
    module, _, attribute = target.partition(":")
    loaded = importlib.import_module(module)
    if attribute.endswith(".yaml"):
        return Path(str(loaded.__file__)).parent / attribute
    return getattr(loaded, attribute)
