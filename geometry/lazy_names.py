"""Names of a package that are imported from their modules when they are first used (PEP 562)."""

import sys
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any


def lazy_names(package: str, homes: Mapping[str, str]) -> Callable[[str], Any]:
    """`__getattr__` of a package. Also sets the package's `__dir__`, from which editors complete names.

    `homes` maps a module to the names that it defines, separated by blanks. The module is relative to the package, or
    absolute if it begins with `fgbaseline.`. Type checkers read the imports under TYPE_CHECKING; a test checks that
    both have the same names.
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
