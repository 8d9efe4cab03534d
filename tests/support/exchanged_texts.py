"""Write an example with some of its texts exchanged."""

from pathlib import Path


def write_exchanged(path: Path, text: str, *exchanged: tuple[str, str]) -> Path:
    """Write a text with each old part replaced by a new one; an old part that is not in it fails.

    Args:
        path: The file.
        text: The example.
        exchanged: Old and new parts.
    """
    for old, new in exchanged:
        assert old in text, old
        text = text.replace(old, new)
    path.write_text(text, encoding="utf-8")
    return path
