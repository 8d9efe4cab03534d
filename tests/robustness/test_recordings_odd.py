"""Recordings that are odd and valid are read; clocks that no bench has are refused; HDF5 is not followed out of the file."""

import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest
from recorded_files import FORCES, N, db3_folder

import bowdenfit as bf
from bowdenfit.files import read_channels

pytestmark = pytest.mark.extended

ANGLE = (180, "deg")


@pytest.mark.parametrize("step", ["1e-320", "5e-324", "1e-300", "1e-12", "1e7", "1e300", "1e305"])
def test_clocks_that_no_bench_has_are_refused(tmp_path, step):
    rows = "".join(f"{i * float(step)!r},{40 + i % 9},{30 + i % 9}\n" for i in range(200))
    (tmp_path / "clock.csv").write_text(f"time (s),input force (N),output force (N)\n{rows}")
    with pytest.raises(bf.DatasetError, match=r"clock\.csv: the samples of input_force are .* s apart"):
        bf.read(tmp_path / "clock.csv", wrap_angle=ANGLE, channels=["input_force=input force", "output_force=output force"])


@pytest.mark.parametrize("step", [1e-6, 60.0])
def test_clocks_from_a_microsecond_to_a_minute_are_read(tmp_path, step):
    rows = "".join(f"{i * step!r},{40 + i % 9},{30 + i % 9}\n" for i in range(200))
    (tmp_path / "clock.csv").write_text(f"time (s),input force (N),output force (N)\n{rows}")
    names = ["input_force=input force", "output_force=output force"]
    assert bf.read(tmp_path / "clock.csv", wrap_angle=ANGLE, channels=names).measurements


@pytest.mark.parametrize("name", ["X.TOML", "cable.Toml"])
def test_a_description_may_be_called_anything_that_ends_so_in_capitals_too(on_body, tmp_path, name):
    folder = shutil.copytree(on_body, tmp_path / "cable.toml")  # a folder may be called so
    assert bf.read(folder).measurements
    (folder / "cable.toml").rename(folder / name)
    assert bf.read(folder / name).measurements


def test_the_folder_of_a_ros_2_bag_is_read_alone_and_named_in_a_description(tmp_path):
    db3_folder(tmp_path / "bag")
    channels = [f"{end}_force=/{end}_force_N.data:N" for end in ("input", "output")]
    alone = bf.read(tmp_path / "bag", wrap_angle=ANGLE, channels=channels)
    named = ", ".join(f'{end}_force = {{ name = "/{end}_force_N.data", unit = "N" }}' for end in ("input", "output"))
    (tmp_path / "cable.toml").write_text(
        'schema = 1\nname = "a"\n[[contact]]\nname = "rope"\nfriction = "mu"\n'
        'wrap_angle = { value = 180, unit = "deg" }\n[tables.recordings]\n'
        f'[[recording]]\nfile = "bag"\nrun = "a"\nchannels = {{ {named} }}\n'
    )
    both = [dataset.sha256["bag"] for dataset in (alone, bf.read(tmp_path))]
    assert both[0] == both[1]
    next((tmp_path / "bag").glob("*.db3")).unlink()
    with pytest.raises(bf.DatasetError, match="bag is cut off or damaged"):
        bf.read(tmp_path / "bag", wrap_angle=ANGLE, channels=channels)


def external_link(file: h5py.File, place: Path) -> None:
    """To a vector in another file."""
    file["odd"] = h5py.ExternalLink(str(place / "other.h5"), "/secret")


def external_storage(file: h5py.File, place: Path) -> None:
    """Numbers that lie in another file, as bytes."""
    file.create_dataset("odd", shape=(N,), dtype="f8", external=[(str(place / "raw.bin"), 0, 8 * N)])


def storage_of_the_system(file: h5py.File, _: Path) -> None:
    """Numbers that are said to lie where users have their names."""
    file.create_dataset("odd", shape=(N,), dtype="u1", external=[("/etc/passwd", 0, N)])


def virtual(file: h5py.File, place: Path) -> None:
    """A data set made of one in another file."""
    layout = h5py.VirtualLayout(shape=(N,), dtype="f8")
    layout[:] = h5py.VirtualSource(str(place / "other.h5"), "secret", shape=(N,))
    file.create_virtual_dataset("odd", layout)


def null(file: h5py.File, _: Path) -> None:
    """A data set without a place for any number."""
    file.create_dataset("odd", data=h5py.Empty("f8"))


def named_type(file: h5py.File, _: Path) -> None:
    """Types of numbers that have names."""
    file["odd"] = np.dtype([("real", "f8"), ("imag", "f8")])


def links(file: h5py.File, _: Path) -> None:
    """Links inside the file, one to nowhere, one to itself."""
    file["odd"] = h5py.SoftLink("/input_force_N")
    file["nowhere"], file["itself"] = h5py.SoftLink("/nowhere/else"), h5py.SoftLink("/itself")


def rings(file: h5py.File, _: Path) -> None:
    """A group that holds itself."""
    group = file.create_group("odd")
    group["inner"] = group


ODD = (external_link, external_storage, storage_of_the_system, virtual, null, named_type, links, rings)


@pytest.mark.parametrize("ending", ["h5", "mat"])
@pytest.mark.parametrize("add", ODD, ids=[item.__name__ for item in ODD])
def test_what_is_odd_in_hdf5_is_left_out_and_the_rest_is_read(tmp_path, add, ending):
    with h5py.File(tmp_path / "other.h5", "w") as other:
        other["secret"] = np.full(N, 4711.0)
    np.full(N, 4711.0).tofile(tmp_path / "raw.bin")
    path = tmp_path / f"odd.{ending}"
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in FORCES.items():
            file[name] = values[None] if ending == "mat" else values
            file[name].attrs["MATLAB_class"] = np.bytes_("double")
        add(file, tmp_path)
    if ending == "mat":
        path.write_bytes(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\0\2IM" + path.read_bytes()[128:])
    channels = read_channels(path)
    assert {channel.name for channel in channels.channels} >= {"input_force_N", "output_force_N"}
    assert not any(np.any(channel.values == 4711) or channel.name.startswith("odd") for channel in channels.channels)
    assert any("odd" in remark for remark in channels.remarks)
