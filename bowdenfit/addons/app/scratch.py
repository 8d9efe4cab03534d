"""The folder of all temporary files of one app and its child processes; what a killed app leaves, the next one clears."""

import os
import shutil
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from filelock import FileLock, Timeout

from bowdenfit.outputs import create_unfinished, forget_unfinished

_PREFIX, _LOCK = "bowdenfit-app-", ".lock"
_YOUNG = 60.0  # s, in which a folder may be without the lock of an app that is starting; a judgement


@contextmanager
def scratch_folder() -> Iterator[Path]:
    """Make the folder in which everything temporary goes during a `with` block, after clearing those of killed apps."""
    _clear_abandoned(Path(tempfile.gettempdir()))
    folder = create_unfinished(lambda: Path(tempfile.mkdtemp(prefix=_PREFIX)))
    saved_folder, saved_variable = tempfile.tempdir, os.environ.get("TMPDIR")
    with FileLock(folder / _LOCK, timeout=0):
        tempfile.tempdir = os.environ["TMPDIR"] = str(folder)
        try:
            yield folder
        finally:
            tempfile.tempdir = saved_folder
            os.environ.pop("TMPDIR")
            os.environ |= {"TMPDIR": saved_variable} if saved_variable is not None else {}
    shutil.rmtree(folder, ignore_errors=True)
    forget_unfinished(folder)


def _clear_abandoned(place: Path) -> None:
    """Remove folders of apps of this user that no longer run."""
    for folder in place.glob(f"{_PREFIX}*"):
        with suppress(OSError, Timeout):  # another app has just cleared it, or runs
            status = folder.lstat()
            is_ours = status.st_uid == os.getuid() if hasattr(os, "getuid") else True
            if folder.is_dir() and not folder.is_symlink() and is_ours and time.time() - status.st_mtime > _YOUNG:
                with FileLock(folder / _LOCK, timeout=0):
                    shutil.rmtree(folder, ignore_errors=True)
