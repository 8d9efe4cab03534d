"""What `bowdenfit check FILE --join OTHER` says of one recording that two loggers wrote."""

from pathlib import Path

from bowdenfit.dataset import load_folder_or_file
from bowdenfit.errors import DatasetError
from bowdenfit.files import read_channels
from bowdenfit.files.isolation import limits_times
from bowdenfit.files.missing_codes import MissingCodes
from bowdenfit.kinds.fit_command import FitCommand, require_recordings
from bowdenfit.questions.check.single_file import (
    ANY_ANGLE,
    describe_channels,
    describe_commands,
    describe_recorded,
)
from bowdenfit.reading import Reading
from bowdenfit.recordings.recording import Recordings
from bowdenfit.words import counted, filled


def describe_joined_files(path: Path, reading: Reading) -> tuple[str, bool]:
    """Describe the files of two loggers and the command that fits them; and return whether they can be fitted as they stand.

    Args:
        path: The file with the input force.
        reading: Keywords of `bowdenfit.read`; the file with the output force among them.

    Raises:
        DatasetError: One cannot be read, or is a table.
    """
    join, channels, limit = Path(str(reading.get("join"))), reading.get("channels", ()), reading.get("reading_limit") or 1
    recordings, obstacle, missing = None, "", reading.get("missing", ())
    require_recordings((path, join), bool(channels), tuple(reading.get("columns", ())))
    with limits_times(limit):
        files = [MissingCodes(tuple(missing)).blank_samples(read_channels(file))[0] for file in (path, join)]
        try:
            data = load_folder_or_file(path, reading.get("settings", ()), channels, (), missing, ANY_ANGLE, limit, join)
            recordings = data.measurements.table(Recordings)
        except DatasetError as error:
            obstacle = str(error)
    lines = list[str]()
    for end, file in zip(("input", "output"), files, strict=True):
        title = f"{file.path.name}: the {end} of a recording ({file.kind}, {counted(len(file.channels), 'channel')})."
        lines += [filled(title), "", *describe_channels(file), ""]
    lines += [*describe_recorded(recordings, obstacle)[1:], ""]
    command = FitCommand(path, (("--wrap-angle", "180deg"),), ("180 deg is the wrap angle of the bench",))
    command = command.with_options("--join", [join]).with_options("--channel", channels).with_options("--missing", missing)
    lines += describe_commands([command], not obstacle)
    return "\n".join(lines) + "\n", not obstacle
