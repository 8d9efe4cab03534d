"""One small valid recording in every kind of file that is read, by the libraries that write such files."""

import shutil
import sqlite3
import warnings
import zipfile
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import h5py
import nptdms
import numpy as np
import openpyxl
import pyarrow
import pyarrow.parquet
import scipy.io
from rosbags.rosbag1 import Writer as Bag1Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Bag2Writer
from rosbags.typesys import Stores, get_typestore

N = 80
TIME = np.arange(N) * 0.01
LOAD = 40.0 + 20.0 * np.sin(TIME * 12)


def _follow_with_friction(force_in: np.ndarray, loss: float = 0.8) -> np.ndarray:
    """Return the output force of a rope that loses a fifth of its force on the pull, and on the return the other way round."""
    output = np.empty_like(force_in)
    rope = loss * force_in[0]
    for i, force in enumerate(force_in):
        rope = float(np.clip(rope, loss * force, force / loss))
        output[i] = rope
    return output


FORCES = {"time_s": TIME, "input_force_N": LOAD, "output_force_N": _follow_with_friction(LOAD)}


def matlab(path: Path) -> None:
    """MATLAB 5, with a structure, text and a matrix."""
    scipy.io.savemat(path, {**FORCES, "rec": {"F": LOAD, "fs": 100.0}, "note": "gauge", "both": np.stack([LOAD, LOAD])})


def packed_matlab(path: Path) -> None:
    """MATLAB 7, compressed."""
    scipy.io.savemat(path, {**FORCES, "cells": np.array([LOAD, "a"], dtype=object)}, do_compression=True)


def old_matlab(path: Path) -> None:
    """MATLAB 4."""
    scipy.io.savemat(path, FORCES, format="4")


def modern_matlab(path: Path) -> None:
    """MATLAB 7.3: 512 bytes, then HDF5."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in FORCES.items():
            file[name] = values[None]
            file[name].attrs["MATLAB_class"] = np.bytes_("double")
        file["rec/F"] = LOAD[None]
    path.write_bytes(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM" + path.read_bytes()[128:])


def hdf5(path: Path) -> None:
    """HDF5 with groups, attributes, a table of records and packed data."""
    with h5py.File(path, "w") as file:
        for name, values in FORCES.items():
            file.create_dataset(f"bench/{name}", data=values, chunks=(20,), compression="gzip")
            file[f"bench/{name}"].attrs["unit"] = "N"
        file["bench"].attrs["sampling_rate"] = 100.0
        file["records"] = np.array(list(zip(TIME, LOAD, strict=True)), dtype=[("t", "f8"), ("F", "f4")])


def tdms(path: Path) -> None:
    """TDMS in four segments."""
    settings = {"unit_string": "N", "wf_increment": 0.01, "wf_start_offset": 0.0}
    with nptdms.TdmsWriter(path) as writer:
        for part in np.split(np.arange(N), 4):
            objects = [nptdms.ChannelObject("a", name, v[part], properties=settings) for name, v in FORCES.items()]
            writer.write_segment(objects)


def mdf(path: Path) -> None:
    """MDF 4 with three channels and a text."""
    from asammdf import MDF, Signal

    with warnings.catch_warnings(), MDF(version="4.10") as file:
        warnings.simplefilter("ignore")
        file.append([Signal(values, TIME, name=name, unit="N") for name, values in FORCES.items()])
        file.append([Signal(np.array([b"ab", b"c"]), TIME[:2], name="note", encoding="utf-8")])
        file.save(path)


def workbook(path: Path) -> None:
    """A workbook with a sheet of data and one of remarks."""
    book = openpyxl.Workbook()
    sheet = book.active
    sheet.append(["time (s)", "input force (N)", "output force (N)"])
    for row in zip(*FORCES.values(), strict=True):
        sheet.append(list(map(float, row)))
    book.create_sheet("remarks").append(["made on Monday"])
    book.save(path)


def arrays(path: Path) -> None:
    """An archive of NumPy, compressed, with an object and a word."""
    np.savez_compressed(path, **FORCES, cells=np.array([LOAD, "a"], dtype=object), word="a")


def parquet(path: Path) -> None:
    """Parquet in two row groups, with a column of timestamps and one of words."""
    columns = {**FORCES, "stamp": pyarrow.array(range(N), pyarrow.timestamp("ms")), "word": ["a"] * N}
    pyarrow.parquet.write_table(pyarrow.table(columns), path, row_group_size=50)


def bag1(path: Path) -> None:
    """A ROS 1 bag."""
    types = get_typestore(Stores.ROS1_NOETIC)
    with Bag1Writer(path) as writer:
        _topics(writer, types, types.serialize_ros1)


def _bag2(path: Path, plugin: StoragePlugin) -> None:
    """A file of ROS 2, taken out of its folder."""
    folder, types = path.with_suffix(""), get_typestore(Stores.ROS2_HUMBLE)
    with Bag2Writer(folder, version=8, storage_plugin=plugin) as writer:
        _topics(writer, types, types.serialize_cdr)
    (written_path,) = folder.glob(f"*{path.suffix}")
    if path.suffix == ".db3":
        with closing(sqlite3.connect(written_path)) as database:
            database.execute("vacuum")
    written_path.rename(path)
    shutil.rmtree(folder)


def db3_folder(path: Path) -> None:
    """A ROS 2 bag as it is recorded: a folder."""
    types = get_typestore(Stores.ROS2_HUMBLE)
    with Bag2Writer(path, version=8, storage_plugin=StoragePlugin.SQLITE3) as writer:
        _topics(writer, types, types.serialize_cdr)


def _topics(writer: object, types: object, pack: Callable[..., bytes]) -> None:
    message = types.types["std_msgs/msg/Float64"]
    for name in ("input_force_N", "output_force_N"):
        connection = writer.add_connection(f"/{name}", "std_msgs/msg/Float64", typestore=types)
        for i, value in enumerate(FORCES[name][:30]):
            moment = 1_700_000_000 * 10**9 + i * 10**7
            writer.write(connection, moment, pack(message(data=float(value)), connection.msgtype))


def db3(path: Path) -> None:
    """A ROS 2 bag in SQLite."""
    _bag2(path, StoragePlugin.SQLITE3)


def mcap(path: Path) -> None:
    """A ROS 2 bag in MCAP."""
    _bag2(path, StoragePlugin.MCAP)


def logger_pro(path: Path) -> None:
    """Logger Pro's XML."""
    columns = "".join(
        f"<DataColumn><DataObjectName>{name}</DataObjectName><ColumnUnits>{name[-1]}</ColumnUnits><ColumnCells>"
        + "\n".join(f"{value:.4f}" for value in values)
        + "</ColumnCells></DataColumn>"
        for name, values in FORCES.items()
    )
    path.write_text(f'<?xml version="1.0"?><Document><DataSet>{columns}</DataSet></Document>')


def table(path: Path) -> None:
    """Columns of text."""
    rows = [f"{t:.2f},{i:.3f},{o:.3f}" for t, i, o in zip(*FORCES.values(), strict=True)]
    path.write_text("\n".join(["time (s),input force (N),output force (N)", *rows]) + "\n")


def german_table(path: Path) -> None:
    """The same in UTF-16 with semicolons and decimal commas."""
    rows = [f"{t:.2f};{i:.3f};{o:.3f}".replace(".", ",") for t, i, o in zip(*FORCES.values(), strict=True)]
    path.write_text("\n".join(["Zeit (s);Eingangskraft (N);Ausgangskraft (N)", *rows]) + "\n", encoding="utf-16")


def archive(path: Path) -> None:
    """A ZIP archive that holds a table."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("mimetype", "text/csv")
        file.writestr("a.csv", "F_N,x_mm\n" + "1,2\n" * 50)


WRITERS: dict[str, Callable[[Path], None]] = {
    "plain.mat": matlab, "packed.mat": packed_matlab, "old.mat": old_matlab, "modern.mat": modern_matlab, "a.h5": hdf5,
    "a.tdms": tdms, "a.mf4": mdf, "a.xlsx": workbook, "a.parquet": parquet, "a.bag": bag1, "a.db3": db3, "a.mcap": mcap,
    "a.npz": arrays, "a.cmbl": logger_pro, "a.csv": table, "german.txt": german_table, "zip.xlsx": archive,
}  # fmt: skip


def channels_of(name: str) -> list[str]:
    """What has to be said of a file to read it: which topics of a bag are the forces.

    Args:
        name: Of `WRITERS`.
    """
    topics = [f"{end}_force=/{end}_force_N.data:N" for end in ("input", "output")]
    return topics if name.endswith((".bag", ".db3", ".mcap")) else []
