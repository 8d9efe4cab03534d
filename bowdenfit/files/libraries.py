"""Libraries that only some files need: loaded when the first such file is read."""

import importlib
from types import ModuleType

from bowdenfit.errors import DatasetError


def load(module: str, kind: str) -> ModuleType:
    """The library called `module`.

    Args:
        module: Name to import, such as "openpyxl" or "pyarrow.parquet".
        kind: What it reads, for the error: ".xlsx", "Parquet".

    Raises:
        DatasetError: It is not installed.
    """
    try:
        return importlib.import_module(module)
    except ImportError:
        library = module.partition(".")[0]
        raise DatasetError(
            f"reading {kind} files needs {library}, which is not installed; install it with pip install 'bowdenfit[lab]'."
        ) from None
