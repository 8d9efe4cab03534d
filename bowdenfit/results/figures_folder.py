"""The figures folder of a fit: its captions file, and which figures are drawn and unchanged."""

from collections.abc import Collection, Iterable, Mapping
from pathlib import Path
from typing import Any

from bowdenfit.errors import StoreError
from bowdenfit.results.answer_cache import add_answer, file_checksum, installed_version, read_answers
from bowdenfit.results.folder import FIGURES, read_text, write_text
from bowdenfit.words import filled, printable

CAPTIONS = "captions.txt"


def copy_captions(source: Path, target: Path) -> None:
    """Copy the captions of figures that stay in a folder, to be written again with those of others.

    Args:
        source: The folder.
        target: Where others are being written.
    """
    if (source / CAPTIONS).is_file():
        write_text(target / CAPTIONS, read_text(source / CAPTIONS))


def write_captions(captions: Mapping[str, str], folder: Path, order: Iterable[str] = ()) -> Path:
    """Write the captions of some figures, a paragraph each, beside those of the others in the folder.

    Args:
        captions: By figure.
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


_DRAWN = "drawn"


def record_drawn_figures(folder: Path, captions: Mapping[str, str]) -> None:
    """Record which figures have been drawn, with checksums of their files.

    Args:
        folder: The results folder, whose figures have all been drawn.
        captions: Of each figure, by its name.
    """
    files = {path.name: file_checksum(path) for path in (folder / FIGURES).iterdir() if path.stem in captions}
    add_answer(folder, _DRAWN, {"with": installed_version("matplotlib"), "captions": dict(captions), "files": files})


def captions_if_unchanged(folder: Path, names: Collection[str], endings: Collection[str]) -> dict[str, str] | None:
    """Return all captions by figure name; None unless every requested figure exists as it would be drawn now.

    Args:
        folder: The results folder.
        names: Of those asked for; all if empty.
        endings: In which formats.
    """
    page: dict[str, Any] = read_answers(folder).get(_DRAWN, {})
    if page.get("with") != installed_version("matplotlib"):
        return None
    captions: dict[str, str] = page["captions"]
    files = [f"{name}.{ending}" for name in names or captions for ending in endings]
    try:
        same = all(page["files"][file] == file_checksum(folder / FIGURES / file) for file in files)
    except (KeyError, StoreError, OSError):  # a figure that it has not, or something else that lies there
        return None
    return captions if same else None
