"""cyclopean at a notebook: results, scores, displays, pictures and sessions, with tables as pandas DataFrames.

    import cyclopean

    trials = cyclopean.read_results("results/dynamic_range")
    cyclopean.scores(trials).to_frame()

Nothing is computed here. Each function calls the function of another package that the command line calls too; what it
returns keeps that function's full result as ``value``. Paths may be `str` or `pathlib.Path`.
"""

from importlib.util import find_spec
from pathlib import Path

import lazy_loader

_HERE = Path(__file__).parents[1]


def _refuse_hidden() -> None:
    """Say so if a file of the user hides one of the packages that this one calls."""
    for package in ("documents", "devices", "stimuli", "analysis", "runner", "extensions"):
        places = list(spec.submodule_search_locations or [spec.origin or ""]) if (spec := find_spec(package)) else []
        own = any(Path(place).resolve() == (_HERE / package).resolve() for place in places)
        if not own and (places or package != "extensions"):  # the core runs without it
            where = f"{places[0]} hides it" if places else "it is not installed beside cyclopean"
            raise ImportError(f"cyclopean needs its own package '{package}', but {where}; rename that file or folder")


_refuse_hidden()

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
