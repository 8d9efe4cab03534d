"""Files of a results folder that were made to look into other files, or to fill the memory, with checksums that are right."""

import io
import json
import resource
import shutil
import zipfile
from zlib import crc32

import h5py
import numpy as np
import pytest
from fuzzing_results import SHAPES, begun_fleet, resume_fleet

import bowdenfit as bf
from bowdenfit.addons.fleet.folder import CHECKSUM, FLEET_DRAWS, FLEET_PAGE, read_fleet_draws
from bowdenfit.addons.fleet.store import PIECES_FOLDER
from bowdenfit.inference.checkpoint import append_record, checkpoint_header, read_records
from bowdenfit.results.netcdf import read_groups, read_groups_isolated, write_groups
from bowdenfit.results.serialization import read_arrays

pytestmark = pytest.mark.extended

MOST = 200 << 20  # bytes by which one of them may raise what this process holds


@pytest.fixture(autouse=True)
def bounded():
    usage_at_start = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    yield
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 < usage_at_start + MOST


def elsewhere(group, name, path):
    with h5py.File(path.with_name("other.h5"), "w") as other:
        other["x"] = group[name][()]
    del group[name]
    group[name] = h5py.ExternalLink("other.h5", "/x")


def stored_elsewhere(group, name, path):
    shape = group[name].shape
    np.ones(shape).tofile(path.with_name("other.bin"))
    del group[name]
    space, listed = h5py.h5s.create_simple(shape), h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    listed.set_external(str(path.with_name("other.bin")).encode(), 0, h5py.h5f.UNLIMITED)
    h5py.h5d.create(group.id, name.encode(), h5py.h5t.NATIVE_DOUBLE, space, listed)


def of_itself(group, name, path):
    del group[name]
    group[name] = h5py.SoftLink(f"{group.name}/{name}")


def endless(group, name, path):
    shape = group[name].shape
    del group[name]
    group.create_dataset(name, (*shape[:-1], 60_000_000), chunks=(*(1 for _ in shape[:-1]), 1 << 20), dtype="f8")


WAYS = (elsewhere, stored_elsewhere, of_itself, endless)


@pytest.mark.parametrize("way", WAYS)
def test_draws_lie_in_their_file_and_are_no_larger(tmp_path, way):
    path = tmp_path / "posterior.nc"
    write_groups(path, {"posterior": {"mu": np.ones((2, 50)), "tau": np.ones((2, 50))}}, {}, {}, {})
    assert list(read_groups(path)["posterior"]) == ["mu", "tau"]
    with h5py.File(path, "a") as file:
        way(file["posterior"], "mu", path)
    with pytest.raises(ValueError, match=r"lies in|larger than its file"):  # of which loading a fit makes a sentence
        read_groups(path)


def test_draws_are_opened_in_a_process_of_their_own(tmp_path, monkeypatch):
    """HDF5 goes in circles for ever over some damaged files, and only a process can be ended then."""
    write_groups(tmp_path / "posterior.nc", {"posterior": {"mu": np.ones((2, 50))}}, {}, {}, {})
    folder = begun_fleet(tmp_path / "fleet")
    monkeypatch.setattr(h5py, "File", lambda *_: pytest.fail("opened here"))
    assert list(read_groups_isolated(tmp_path / "posterior.nc")["posterior"]) == ["mu"]
    assert set(read_fleet_draws(folder).values) == {"mu", "tau"}


@pytest.mark.parametrize("way", WAYS)
def test_draws_of_a_fleet_lie_in_their_file_and_are_no_larger(tmp_path, way):
    folder = begun_fleet(tmp_path / "fleet")
    read_fleet_draws(folder)
    with h5py.File(folder / FLEET_DRAWS, "a") as file:
        way(file["posterior"], "mu", folder / FLEET_DRAWS)
    page = json.loads((folder / FLEET_PAGE).read_text())
    (folder / FLEET_PAGE).write_text(json.dumps(page | {CHECKSUM: crc32((folder / FLEET_DRAWS).read_bytes())}))
    with pytest.raises(bf.StoreError, match=r"fleet\.nc is damaged"):
        read_fleet_draws(folder)


def claimed(count):
    """An array of so many numbers, as its heading says; two are there."""
    written = io.BytesIO()
    np.lib.format.write_array_header_1_0(written, {"descr": "<f8", "fortran_order": False, "shape": (count,)})
    return written.getvalue() + b"\0" * 16


def archive(path, content):
    with zipfile.ZipFile(path, "w") as file:
        for name in ("page", *SHAPES):
            file.writestr(f"{name}.npy", content)


ARCHIVES = {"claims": claimed(10**9), "claims more": claimed(10**15), "no array": b"x"}


@pytest.mark.parametrize("case", ARCHIVES)
def test_arrays_that_say_that_they_are_larger_than_they_are_are_refused(tmp_path, case):
    archive(tmp_path / "figures.npz", ARCHIVES[case])
    with pytest.raises((ValueError, KeyError)):  # of which whoever reads figures makes figures to be worked out anew
        read_arrays(tmp_path / "figures.npz", {"a": float})


def test_packed_arrays_are_refused_unread(tmp_path):
    with zipfile.ZipFile(tmp_path / "figures.npz", "w", zipfile.ZIP_DEFLATED) as file, file.open("page.npy", "w") as page:
        for _ in range(100):
            page.write(b"\0" * 10**7)
    with pytest.raises(ValueError, match="is packed"):
        read_arrays(tmp_path / "figures.npz", {"a": float})


@pytest.mark.parametrize("case", ARCHIVES)
def test_a_checkpoint_and_pieces_of_a_fleet_hold_no_such_arrays(tmp_path, case):
    archive(tmp_path / "x.npz", ARCHIVES[case])
    path = tmp_path / "chain.checkpoint"
    path.write_bytes(checkpoint_header({"seed": 3}))
    append_record(path, {"z": np.ones(2)})
    whole = path.read_bytes()
    content = (tmp_path / "x.npz").read_bytes()
    record = len(content).to_bytes(8, "little") + crc32(content).to_bytes(4, "little") + content
    path.write_bytes(checkpoint_header({"seed": 3}) + record)
    assert whole.startswith(path.read_bytes()[:20])
    with pytest.raises(bf.StoreError, match=r"chain\.checkpoint is damaged"):
        read_records(path, SHAPES)
    folder = begun_fleet(tmp_path / "fleet")
    (piece,) = (folder / PIECES_FOLDER).glob("*.npz")
    shutil.copy(tmp_path / "x.npz", piece)
    resume_fleet(folder)  # which fits it again
    assert not piece.exists()
