"""matplotlib as this program loads it: without the manual of its artists' properties, which nobody reads here.

While it is loaded, matplotlib asks each of its hundred kinds of artist for all properties, and writes signature and
documentation of `set` from them. That takes half of the time that loading it takes, and changes no figure.
"""

import sys
from collections.abc import Sequence
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec
from importlib.util import find_spec
from types import ModuleType
from typing import Any

_ARTISTS = "matplotlib.artist"


def load_without_manual() -> None:
    """From now on matplotlib, once something loads it, is loaded so; for a process that is all ours."""
    if _ARTISTS not in sys.modules:
        sys.meta_path.insert(0, _Finder())


class _Finder(MetaPathFinder):
    """Finds the module of artists as others do, and has its manual left out once the module is there."""

    def find_spec(self, name: str, path: Sequence[str] | None, target: ModuleType | None = None) -> ModuleSpec | None:
        """See `MetaPathFinder`."""
        del path, target
        if name != _ARTISTS:
            return None
        sys.meta_path.remove(self)
        found = find_spec(name)
        if found is not None and found.loader is not None:
            found.loader.exec_module = _then_without_manual(found.loader.exec_module)  # type: ignore[method-assign]
        return found


def _then_without_manual(load: Any) -> Any:
    def loaded(module: Any) -> None:
        load(module)
        if hasattr(module.Artist, "_update_set_signature_and_docstring"):  # private: other versions may do otherwise
            module.Artist._update_set_signature_and_docstring = classmethod(lambda _: None)
        if hasattr(module, "kwdoc"):
            module.kwdoc = lambda _: ""

    return loaded
