"""What tests of several pages share."""

import shutil
import subprocess
import tarfile

import pytest

_AXE = "axe-core@4.10.2"


@pytest.fixture(scope="session")
def axe(tmp_path_factory):
    """The script of axe-core, from npm; the test is skipped where that cannot be reached."""
    npm, folder = shutil.which("npm"), tmp_path_factory.mktemp("axe")
    if npm is None:
        pytest.skip("there is no npm to get axe-core with")
    command = [npm, "pack", _AXE, "--silent", "--pack-destination", str(folder)]
    packed = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120, cwd=folder)
    if packed.returncode:
        pytest.skip(f"npm cannot get axe-core: {packed.stderr.strip()[-200:]}")
    with tarfile.open(folder / packed.stdout.split()[-1]) as archive:
        return archive.extractfile("package/axe.min.js").read().decode()
