"""Files that are brought together with a cable.toml: each is put where that names it, in its own folder and nowhere else."""

from collections.abc import Iterator
from fnmatch import fnmatchcase
from pathlib import Path, PurePosixPath

from bowdenfit.dataset import DESCRIPTION_FILE
from bowdenfit.description import Description
from bowdenfit.errors import DescriptionError, Faults
from bowdenfit.kinds.descriptions import load_description
from bowdenfit.words import shown

_PATTERN = frozenset("*?[")
_ANY_FOLDER = "files"  # stands for a folder that a pattern leaves open
_MOST_FOLDERS, _LONGEST_PART = 4, 120  # above a file, and characters of a name; judgements


def put_in_place(folder: Path) -> Description:
    """Put files that lie flat beside a cable.toml where that names them, and return what it says.

    Args:
        folder: With the files, and cable.toml.

    Raises:
        DescriptionError: It is wrong, names what does not lie in its folder, or one file in two folders.
    """
    description = load_description(folder / DESCRIPTION_FILE, faults=Faults())
    stated = [_stated_place(name) for name in dict.fromkeys(_named_files(description))]
    exact = [place for place in stated if not _PATTERN & set(place.name)]
    patterns = [place for place in stated if _PATTERN & set(place.name)]
    for path in [path for path in sorted(folder.iterdir()) if path.is_file() and path.name != DESCRIPTION_FILE]:
        places = {place.parent for place in exact if place.name == path.name}
        places = places or {place.parent for place in patterns if fnmatchcase(path.name, place.name)}
        if len(places) > 1:
            raise DescriptionError(
                f"cable.toml names {shown(path.name)} in several folders, and of a file that is brought here only the name is "
                "known; copy the folder with cable.toml into the folder that the app was started in instead."
            )
        for place in places:
            try:
                (folder / place).mkdir(parents=True, exist_ok=True)
            except OSError:
                raise DescriptionError(
                    f"cable.toml names a folder {shown(place.as_posix())}, which cannot be made, because a file has that name; "
                    "rename one of them."
                ) from None
            path.rename(folder / place / path.name)
    return description


def lay_flat(folder: Path) -> None:
    """Put all files below a folder into the folder itself."""
    for path in sorted(folder.rglob("*"), key=lambda path: -len(path.parts)):
        if path.is_dir():
            path.rmdir()
        elif path.parent != folder:
            path.rename(folder / path.name) if not (folder / path.name).exists() else path.unlink()


def _named_files(description: Description) -> Iterator[str]:
    """Yield every file and pattern that a description names."""
    for table in description.tables.stated.values():
        for names in (getattr(table, "file", None), table.files):
            yield from [names] if isinstance(names, str) else names or ()
    for recording in description.recording:
        yield recording.file
        if recording.output_file is not None:
            yield recording.output_file
    for contact in description.contact:
        if contact.wrap_angle.route is not None:
            yield contact.wrap_angle.route


def _stated_place(name: str) -> PurePosixPath:
    """Return where a file lies, as seen from cable.toml.

    Raises:
        DescriptionError: That is not in the folder of cable.toml.
    """
    place = PurePosixPath(name)
    is_elsewhere = name.startswith(("/", "~")) or "\\" in name or ":" in name[:3] or ".." in place.parts
    is_odd = not name.isprintable() or not place.name or max(map(len, place.parts), default=0) > _LONGEST_PART
    if is_elsewhere or is_odd or len(place.parts) > _MOST_FOLDERS + 1:
        raise DescriptionError(
            f"cable.toml names {shown(name)}, which is not in its own folder; put that file next to cable.toml, name it "
            "there without a folder, and bring both again."
        )
    folders = (_ANY_FOLDER if _PATTERN & set(part) else part for part in place.parts[:-1] if part != "**")
    return PurePosixPath(*folders, place.name)
