"""What the figures in a folder show, in words, in one file beside them."""

from collections.abc import Iterable, Mapping
from pathlib import Path

from bowdenfit.results.folder import read_text, write_text
from bowdenfit.words import filled, printable

CAPTIONS = "captions.txt"


def copy_captions(source: Path, target: Path) -> None:
    """Copy the captions of figures that stay in a folder, to be written again with those of others.

    Args:
        there: The folder.
        place: Where others are being written.
    """
    if (source / CAPTIONS).is_file():
        write_text(target / CAPTIONS, read_text(source / CAPTIONS))


def write_captions(captions: Mapping[str, str], folder: Path, order: Iterable[str] = ()) -> Path:
    """Write the captions of some figures, a paragraph each, beside those of the others in the folder.

    Args:
        said: By figure.
        folder: Where the figures are.
        order: Of figures; others follow.
    """
    path = folder / CAPTIONS
    existing = read_text(path).split("\n\n") if path.exists() else []
    texts = {text.partition(":")[0]: text.strip() for text in existing if text.strip()}
    texts |= {name: printable(filled(" ".join(f"{name}: {text}".split()))) for name, text in captions.items()}
    names = [*(name for name in order if name in texts), *(name for name in texts if name not in set(order))]
    write_text(path, "\n\n".join(texts[name] for name in names) + "\n")
    return path
