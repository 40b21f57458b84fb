"""For griffe, which reads the docstrings: a package's public name may be that of the module it comes from.

`from .batch import batch` leaves the function under the name `batch`, and the module out of reach, as Python has it;
griffe keeps the module. Here the function takes its place.
"""

from typing import Any

import griffe


class Exports(griffe.Extension):
    """Puts what packages export in the place of modules of the same name."""

    def on_package(self, *, pkg: griffe.Module, **kwargs: Any) -> None:  # noqa: ARG002
        """Called once all of a package is loaded."""
        modules = [pkg, *_below(pkg)]
        exported = [(module, str(name)) for module in modules for name in module.exports or ()]
        # What is imported has to be found before the modules that it comes from are out of reach.
        for module, name in exported:
            member = module.members[name]
            if isinstance(member, griffe.Alias):
                member.resolve_target()
        functions = []
        for module, name in exported:
            path = module.imports.get(name)
            hidden = module.members[name]
            if hidden.is_module and path is not None and path != hidden.path:
                functions.append((module, name, module.modules_collection[path]))
        for module, name, function in functions:
            module.set_member(name, function)


def _below(module: griffe.Module) -> list[griffe.Module]:
    found: list[griffe.Module] = []
    for child in module.modules.values():
        if not child.is_alias:
            found += [child, *_below(child)]
    return found
