"""Names of a package that are imported from their modules when they are first used (PEP 562)."""

import sys
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any


def lazy_names(package: str, homes: Mapping[str, str]) -> Callable[[str], Any]:
    """The `__getattr__` of a package; its `__dir__`, by which editors complete names, is set.

    `homes` has the names, separated by blanks, by the module that defines them: one below the package, or one of
    another room in full. Type checkers read the imports under TYPE_CHECKING beside it; a test holds both to each other.
    """
    home = {name: module for module, names in homes.items() for name in names.split()}
    own = vars(sys.modules[package])

    def attribute(name: str) -> Any:
        if name not in home:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        place = home[name]
        module = import_module(place if place.startswith("fgbaseline.") else f"{package}.{place}")
        return module if place == name else getattr(module, name)

    own["__dir__"] = lambda: sorted({*own, *home})
    return attribute
