"""The page that a package index shows: README.md with every link and image such that they work there.

An index shows images and follows links only where they begin with https://; names of files are dead there, and an image in the
page itself is stripped. With a line `Source = "https://..."` under `[project.urls]` they lead to that repository, as GitHub
names its files; without one each says in words which file of the source distribution it is. Hatchling asks while it builds.
"""

import re
from pathlib import Path
from typing import Any

from hatchling.metadata.plugin.interface import MetadataHookInterface

_LINK = re.compile(r"(?P<image>!?)\[(?P<words>[^\]]*)\]\((?!https://|#)(?P<file>[^)\s]+)\)")


def index_page(readme: str, source: str | None = None) -> str:
    """README.md as an index can show it.

    Args:
        readme: Its text.
        source: Where the repository is on the network; None if nowhere.
    """

    def there(match: re.Match[str]) -> str:
        image, words, file = match["image"], match["words"], match["file"]
        if source is not None:
            return f"{image}[{words}]({source.rstrip('/')}/{'raw' if image else 'blob'}/HEAD/{file})"
        return f"*Figure, {file} in the source distribution: {words}*" if image else f"{words} (`{file}`)"

    return _LINK.sub(there, readme)


class IndexPage(MetadataHookInterface):
    """What hatchling asks for the description of the package."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Describe the package."""
        text = (Path(self.root) / "README.md").read_text(encoding="utf-8")
        page = index_page(text, metadata.get("urls", {}).get("Source"))
        metadata["readme"] = {"content-type": "text/markdown", "text": page}
