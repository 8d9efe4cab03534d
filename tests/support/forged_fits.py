"""A fit that was edited by somebody who wrote its checksum anew."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from bowdenfit.results.answer_cache import CHECKSUM, page_checksum


def sealed(page: dict[str, Any]) -> str:
    """A page with the checksum of what it says."""
    contents = {key: value for key, value in page.items() if key != CHECKSUM}
    return json.dumps(contents | {CHECKSUM: page_checksum(contents)})


def edit_sealed(path: Path, change: Callable[[dict[str, Any]], None]) -> None:
    """Change a page in its place.

    Args:
        path: The file.
        change: Changes what it says.
    """
    page = json.loads(path.read_text())
    change(page)
    path.write_text(sealed(page))
