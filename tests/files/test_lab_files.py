"""Recordings in the binary files of laboratories, written here by other libraries' writers."""

import gzip
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

import h5py
import nptdms
import numpy as np
import pytest
import scipy.io
from rosbags.rosbag1 import Writer as Bag1Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Bag2Writer
from rosbags.typesys import Stores, get_typestore

from bowdenfit.errors import DatasetError
from bowdenfit.files import channels, read_channels, read_here
from bowdenfit.files.channels import Channel, ChannelFile

pytestmark = pytest.mark.extended

RATE = 1000.0
RANDOM = np.random.default_rng(7)
FORCE_IN, FORCE_OUT = RANDOM.normal(20.0, 3.0, 2000), RANDOM.normal(15.0, 3.0, 2000)
TIME = np.arange(2000) / RATE + 0.25
START = 1_700_000_000 * 10**9


def channel(file: ChannelFile, name: str) -> Channel:
    return next(item for item in file.channels if item.name == name)


def names(file: ChannelFile) -> list[str]:
    return [item.name for item in file.channels]


def refusal(path: Path, read: Callable[[Path], object] = read_channels) -> str:
    with pytest.raises(DatasetError) as caught:
        read(path)
    return str(caught.value)


def assert_same(computed: Channel, values: np.ndarray, time: np.ndarray, unit: str = "") -> None:
    assert computed.values.dtype == np.float64 and computed.unit == unit
    np.testing.assert_array_equal(computed.values, values)
    assert computed.time is not None
    np.testing.assert_array_equal(computed.time, time)


def write_mat(path: Path) -> None:
    scipy.io.savemat(path, {"F_in": FORCE_IN[:, None], "F_out": FORCE_OUT[None], "t": TIME[:, None]})


def write_mat_packed(path: Path) -> None:
    scipy.io.savemat(path, {"F_in": FORCE_IN[:, None], "t": TIME[:, None]}, do_compression=True)


def write_mat73(path: Path) -> None:
    """As MATLAB does with -v7.3: 512 bytes of header, then HDF5 with transposed arrays and classes in attributes."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in {"F_in": FORCE_IN[None], "t": TIME[None], "both": np.stack([FORCE_IN, FORCE_OUT])}.items():
            file[name] = values
            file[name].attrs["MATLAB_class"] = np.bytes_("double")
        file["rec/F_out"] = FORCE_OUT[None]
        file["rec/F_out"].attrs["MATLAB_class"] = np.bytes_("double")
        file["rec"].attrs["MATLAB_class"] = np.bytes_("struct")
        file["#refs#/a"] = FORCE_IN[None]
        file["note"] = np.frombuffer("gauge".encode("utf-16-le"), dtype=np.uint16)[None]
        file["note"].attrs["MATLAB_class"] = np.bytes_("char")
        file["runs"] = np.zeros((1, 6), dtype=np.uint32)
        file["runs"].attrs["MATLAB_class"] = np.bytes_("timetable")
        file["runs"].attrs["MATLAB_object_decode"] = np.int32(3)
        file["nothing"] = np.array([0, 0], dtype=np.uint64)
        file["nothing"].attrs["MATLAB_class"] = np.bytes_("double")
        file["nothing"].attrs["MATLAB_empty"] = np.uint8(1)
    header = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM"
    path.write_bytes(header.ljust(512, b"\0") + path.read_bytes()[512:])


def write_hdf5(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file["bench/force_in"] = FORCE_IN
        file["bench/force_in"].attrs["unit"] = "N"
        file["bench/both"] = np.column_stack([FORCE_IN, FORCE_OUT])
        file["bench/both"].attrs["units"] = np.bytes_("kgf")
        file["bench"].attrs["sampling_rate"] = RATE
        file["other/time"] = TIME
        file["other/force"] = FORCE_OUT.astype(np.float32)
        file["image"] = np.zeros((100, 100))
        file["note"] = "a gauge"


def write_tdms(path: Path) -> None:
    settings = {"unit_string": "N", "wf_increment": 1 / RATE, "wf_start_offset": 0.25}
    with nptdms.TdmsWriter(path) as writer:
        for part in np.split(np.arange(2000), 4):
            recorded = (("F_in", FORCE_IN), ("F_out", FORCE_OUT))
            writer.write_segment([nptdms.ChannelObject("bench", n, v[part], properties=settings) for n, v in recorded])


def typestore_messages(store: Stores) -> tuple:
    types = get_typestore(store)
    return types, types.types


def write_topics(writer, types, message, pack: Callable[..., bytes], header: Callable[[int], object]) -> None:
    force = writer.add_connection("/force", "geometry_msgs/msg/WrenchStamped", typestore=types)
    load = writer.add_connection("/load", "std_msgs/msg/Float64", typestore=types)
    joint = writer.add_connection("/joint", "sensor_msgs/msg/JointState", typestore=types)
    note = writer.add_connection("/note", "std_msgs/msg/String", typestore=types)
    vector, empty = message["geometry_msgs/msg/Vector3"], np.array([])
    for i in range(40):
        moment = START + i * 10**7
        wrench = message["geometry_msgs/msg/Wrench"](force=vector(FORCE_IN[i], 0.0, 0.0), torque=vector(0.0, 0.0, 0.0))
        stamped = message["geometry_msgs/msg/WrenchStamped"](header=header(moment), wrench=wrench)
        effort = np.array([FORCE_OUT[i], 2.0]) if i else np.array([FORCE_OUT[i], 2.0, 3.0])
        state = message["sensor_msgs/msg/JointState"](
            header=header(0), name=["a"], position=empty, velocity=empty, effort=effort
        )
        for connection, content in (
            (force, stamped),
            (load, message["std_msgs/msg/Float64"](data=FORCE_OUT[i])),
            (joint, state),
            (note, message["std_msgs/msg/String"](data="hello")),
        ):
            writer.write(connection, moment + 500, pack(content, connection.msgtype))


def write_bag1(path: Path) -> None:
    types, message = typestore_messages(Stores.ROS1_NOETIC)

    def header(moment: int) -> object:
        stamp = message["builtin_interfaces/msg/Time"](sec=moment // 10**9, nanosec=moment % 10**9)
        return message["std_msgs/msg/Header"](seq=1, stamp=stamp, frame_id="")

    with Bag1Writer(path) as writer:
        write_topics(writer, types, message, types.serialize_ros1, header)


def write_bag2(path: Path, plugin: StoragePlugin) -> None:
    types, message = typestore_messages(Stores.ROS2_HUMBLE)

    def header(moment: int) -> object:
        stamp = message["builtin_interfaces/msg/Time"](sec=moment // 10**9, nanosec=moment % 10**9)
        return message["std_msgs/msg/Header"](stamp=stamp, frame_id="")

    with Bag2Writer(path, version=8, storage_plugin=plugin) as writer:
        write_topics(writer, types, message, types.serialize_cdr, header)


def write_db3(path: Path) -> None:
    write_bag2(path.with_suffix(""), StoragePlugin.SQLITE3)
    (path.with_suffix("") / f"{path.stem}.db3").rename(path)


def write_mcap(path: Path) -> None:
    write_bag2(path.with_suffix(""), StoragePlugin.MCAP)
    (path.with_suffix("") / f"{path.stem}.mcap").rename(path)


WRITERS: dict[str, Callable[[Path], None]] = {
    "plain.mat": write_mat,
    "packed.mat": write_mat_packed,
    "modern.mat": write_mat73,
    "a.h5": write_hdf5,
    "a.bag": write_bag1,
    "a.db3": write_db3,
    "a.mcap": write_mcap,
}


@pytest.fixture(scope="module")
def mf4(tmp_path_factory: pytest.TempPathFactory) -> Path:
    from asammdf import MDF, Signal

    path = tmp_path_factory.mktemp("mdf") / "a.mf4"
    with MDF(version="4.10") as file:
        file.append([Signal(FORCE_IN, TIME, name="F_in", unit="N"), Signal(FORCE_OUT, TIME, name="F", unit="N")])
        file.append([Signal(np.arange(50), TIME[:50], name="F", unit="mm")])
        file.append([Signal(np.array([b"ab", b"c"]), TIME[:2], name="note", encoding="utf-8")])
        invalid = np.array([False, True, False])
        file.append([Signal(np.arange(3.0), TIME[:3], name="gap", invalidation_bits=invalid)])
        file.save(path)
    return path


def test_matlab_vectors_come_back_to_the_last_bit_with_the_time_vector_behind_them(tmp_path: Path) -> None:
    write_mat(tmp_path / "a.MAT")
    file = read_channels(tmp_path / "a.MAT")
    assert file.kind == "MATLAB" and names(file) == ["F_in", "F_out", "t"] and file.remarks == ()
    assert_same(channel(file, "F_in"), FORCE_IN, TIME)
    assert_same(channel(file, "F_out"), FORCE_OUT, TIME)
    assert channel(file, "F_in").clock == "t"


def test_matlab_matrices_and_structures_get_the_names_by_which_matlab_takes_them(tmp_path: Path) -> None:
    wide, tall = np.stack([FORCE_IN, FORCE_OUT]), np.column_stack([FORCE_IN, FORCE_OUT])
    pair = np.array([({"F": FORCE_IN}), ({"F": FORCE_OUT})], dtype=object)
    cells = np.array([FORCE_IN, "text"], dtype=object)
    content = {"wide": wide, "tall": tall, "rec": {"F": FORCE_IN, "deep": {"x": FORCE_OUT}}, "cells": cells}
    scipy.io.savemat(tmp_path / "a.mat", {**content, "note": "gauge", "cube": np.zeros((3, 3, 3)), "pair": pair})
    file = read_channels(tmp_path / "a.mat")
    assert names(file) == ["wide(1,:)", "wide(2,:)", "tall(:,1)", "tall(:,2)", "rec.F", "rec.deep.x"]
    np.testing.assert_array_equal(channel(file, "wide(2,:)").values, FORCE_OUT)
    np.testing.assert_array_equal(channel(file, "tall(:,1)").values, FORCE_IN)
    assert [word for word in ("cells", "note", "cube", "pair") if word not in " ".join(file.remarks)] == []


def test_matlab_structures_each_use_their_own_clock(tmp_path: Path) -> None:
    first, second = {"F": FORCE_IN, "t": TIME}, {"F": FORCE_OUT, "t": TIME + 100}
    scipy.io.savemat(tmp_path / "a.mat", {"run1": first, "run2": second})
    file = read_channels(tmp_path / "a.mat")
    assert_same(channel(file, "run1.F"), FORCE_IN, TIME)
    assert_same(channel(file, "run2.F"), FORCE_OUT, TIME + 100)
    assert channel(file, "run2.F").clock == "run2.t"


@pytest.mark.parametrize(("name", "value"), [("Fs", RATE), ("sampling_rate", RATE), ("dt", 1 / RATE)])
def test_a_matlab_scalar_that_names_the_rate_is_the_clock_and_is_told(tmp_path: Path, name: str, value: float) -> None:
    scipy.io.savemat(tmp_path / "a.mat", {name: value, "F_in": FORCE_IN})
    file = read_channels(tmp_path / "a.mat")
    assert_same(channel(file, "F_in"), FORCE_IN, np.arange(2000) * (1 / RATE))
    assert channel(file, "F_in").clock == name and name in file.remarks[0]


def test_a_matlab_file_of_text_alone_is_refused_with_a_remedy(tmp_path: Path) -> None:
    scipy.io.savemat(tmp_path / "a.mat", {"note": "gauge"})
    assert "plain vectors" in refusal(tmp_path / "a.mat") and "'note'" in refusal(tmp_path / "a.mat")


def test_modern_matlab_files_are_transposed_back_and_objects_left_out(tmp_path: Path) -> None:
    write_mat73(tmp_path / "a.mat")
    file = read_channels(tmp_path / "a.mat")
    assert sorted(names(file)) == ["F_in", "both(:,1)", "both(:,2)", "rec.F_out", "t"]
    assert_same(channel(file, "F_in"), FORCE_IN, TIME)
    assert_same(channel(file, "both(:,2)"), FORCE_OUT, TIME)
    assert_same(channel(file, "rec.F_out"), FORCE_OUT, TIME)
    assert [word for word in ("note", "runs", "nothing") if word not in " ".join(file.remarks)] == []


def test_hdf5_data_sets_have_their_path_unit_and_rate(tmp_path: Path) -> None:
    write_hdf5(tmp_path / "a.hdf5")
    file = read_channels(tmp_path / "a.hdf5")
    counted = np.arange(2000) * (1 / RATE)
    with_time = ["bench/both[:,0]", "bench/both[:,1]", "bench/force_in", "other/force", "other/time"]
    assert sorted(names(file)) == with_time
    assert_same(channel(file, "other/force"), FORCE_OUT.astype(np.float32).astype(float), TIME)
    assert channel(file, "bench/force_in").unit == "N" and channel(file, "bench/both[:,1]").unit == "kgf"
    np.testing.assert_array_equal(channel(file, "bench/both[:,1]").values, FORCE_OUT)
    assert_same(channel(file, "bench/force_in"), FORCE_IN, counted, "N")
    assert "image" in " ".join(file.remarks) and "sampling_rate" in " ".join(file.remarks)


def test_the_only_clock_of_a_file_serves_all_its_groups_but_one_of_two_does_not(tmp_path: Path) -> None:
    for number, clocks in enumerate((["clock/time"], ["clock/time", "second/time"])):
        with h5py.File(tmp_path / f"{number}.h5", "w") as file:
            file["bench/force"] = FORCE_IN
            for name in clocks:
                file[name] = TIME
    assert_same(channel(read_channels(tmp_path / "0.h5"), "bench/force"), FORCE_IN, TIME)
    assert channel(read_channels(tmp_path / "1.h5"), "bench/force").time is None


def test_tdms_channels_have_their_group_unit_and_waveform_time(tmp_path: Path) -> None:
    write_tdms(tmp_path / "a.tdms")
    file = read_channels(tmp_path / "a.tdms")
    assert file.kind == "TDMS" and names(file) == ["bench/F_in", "bench/F_out"] and file.remarks == ()
    assert_same(channel(file, "bench/F_in"), FORCE_IN, np.linspace(0.25, 0.25 + 1999 / RATE, 2000), "N")


def test_tdms_without_waveform_uses_the_time_channel_of_the_group(tmp_path: Path) -> None:
    dates = np.datetime64("2024-05-01T10:00:00.000000") + np.arange(2000).astype("timedelta64[ms]")
    with nptdms.TdmsWriter(tmp_path / "a.tdms") as writer:
        objects = [nptdms.ChannelObject("bench", "Time", dates), nptdms.ChannelObject("bench", "F", FORCE_IN)]
        writer.write_segment([*objects, nptdms.ChannelObject("bench", "note", ["a", "b"])])
    file = read_channels(tmp_path / "a.tdms")
    assert_same(channel(file, "bench/F"), FORCE_IN, np.arange(2000) / 1000)
    assert channel(file, "bench/F").clock == "bench/Time" and "bench/note" in file.remarks[0]


@pytest.mark.parametrize("share", [0.3, 0.6, 0.95])
def test_a_tdms_file_cut_off_keeps_its_whole_samples_and_says_so(
    tmp_path: Path, share: float, capfd: pytest.CaptureFixture[str]
) -> None:
    write_tdms(tmp_path / "a.tdms")
    content = (tmp_path / "a.tdms").read_bytes()
    (tmp_path / "a.tdms").write_bytes(content[: int(share * len(content))])
    file = read_channels(tmp_path / "a.tdms")
    count = len(file.channels[0].values)
    assert 0.7 * share * 2000 < count < 2000 and "cut off" in file.remarks[0] and str(count) in file.remarks[0]
    np.testing.assert_array_equal(channel(file, "bench/F_in").values, FORCE_IN[:count])
    np.testing.assert_array_equal(channel(file, "bench/F_out").values, FORCE_OUT[:count])
    assert capfd.readouterr().err == ""


def test_a_tdms_file_without_one_whole_sample_is_refused(tmp_path: Path) -> None:
    write_tdms(tmp_path / "a.tdms")
    (tmp_path / "a.tdms").write_bytes((tmp_path / "a.tdms").read_bytes()[:900])
    assert "a.tdms is cut off or damaged" in refusal(tmp_path / "a.tdms")


def test_mdf_channels_have_the_time_of_their_group_and_names_of_their_own(mf4: Path) -> None:
    file = read_channels(mf4)
    assert file.kind == "MDF4" and names(file) == ["F_in", "group 1/F", "group 2/F", "gap"]
    assert_same(channel(file, "F_in"), FORCE_IN, TIME, "N")
    assert_same(channel(file, "group 1/F"), FORCE_OUT, TIME, "N")
    assert_same(channel(file, "group 2/F"), np.arange(50.0), TIME[:50], "mm")
    assert len(file.remarks) == 1 and "'note'" in file.remarks[0]


def test_mdf_samples_that_the_logger_called_invalid_are_missing(mf4: Path) -> None:
    assert_same(channel(read_channels(mf4), "gap"), np.array([0.0, np.nan, 2.0]), TIME[:3])


@pytest.mark.parametrize("share", [0.02, 0.6, 0.95, 0.999])
def test_an_mdf_file_cut_off_is_refused(mf4: Path, tmp_path: Path, share: float) -> None:
    content = mf4.read_bytes()
    (tmp_path / "a.mf4").write_bytes(content[: int(share * len(content))])
    assert "a.mf4 is cut off or damaged" in refusal(tmp_path / "a.mf4")


@pytest.mark.parametrize("kind", ["bag1", "sqlite", "mcap", "a.db3", "a.mcap"])
def test_bags_give_every_number_of_every_topic_with_its_time(tmp_path: Path, kind: str) -> None:
    path = tmp_path / {"bag1": "a.bag", "sqlite": "folder", "mcap": "folder"}.get(kind, kind)
    if path.name == "folder":
        write_bag2(path, StoragePlugin.SQLITE3 if kind == "sqlite" else StoragePlugin.MCAP)
    else:
        WRITERS[path.name](path)
    file = read_channels(path)
    steps = np.arange(40) * 10**7
    assert file.kind == "ROS bag"
    assert_same(channel(file, "/force.wrench.force.x"), FORCE_IN[:40], steps / 1e9)
    assert_same(channel(file, "/load.data"), FORCE_OUT[:40], (steps + 500) / 1e9)
    assert_same(channel(file, "/joint.effort[0]"), FORCE_OUT[:40], (steps + 500) / 1e9)
    assert channel(file, "/force.wrench.force.x").clock == "header.stamp"
    assert np.isnan(channel(file, "/joint.effort[2]").values[1:]).all()
    assert not any("header" in name for name in names(file)) and "'/note'" in file.remarks[0]


@pytest.mark.parametrize("share", [0.02, 0.6, 0.95])
@pytest.mark.parametrize("name", WRITERS)
def test_a_file_cut_off_is_refused_in_one_sentence(tmp_path: Path, name: str, share: float) -> None:
    WRITERS[name](tmp_path / name)
    content = (tmp_path / name).read_bytes()
    (tmp_path / name).write_bytes(content[: int(share * len(content))])
    message = refusal(tmp_path / name)
    assert message.startswith(f"{name} is cut off or damaged (") and message.endswith("from the acquisition computer.")


def test_a_bag_folder_with_a_cut_file_is_refused(tmp_path: Path) -> None:
    write_bag2(tmp_path / "folder", StoragePlugin.MCAP)
    stored = tmp_path / "folder" / "folder.mcap"
    stored.write_bytes(stored.read_bytes()[:-300])
    assert refusal(tmp_path / "folder").startswith("folder is cut off or damaged")


@pytest.mark.parametrize(
    ("start", "ending", "words"),
    [
        (b"\x89HDF\r\n\x1a\n", ".csv", "rename it to .h5"),
        (b"MATLAB 5.0 MAT-file, Platform", ".txt", "rename it to .mat"),
        (b"TDSm", ".csv", "rename it to .tdms"),
        (b"TDSh", ".tdms", "give the .tdms file"),
        (b"MDF     4.10", ".dat", "rename it to .mf4"),
        (b"#ROSBAG V2.0\n", ".h5", "rename it to .bag"),
        (b"PAR1", ".xlsx", "rename it to .parquet"),
        (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", ".xls", "save it as .xlsx"),
        (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", ".xlsx", "without a password"),
        (b"<?xml version='1.0'?><Document>", ".tdms", "export the recording as CSV"),
        (b"<?xml version='1.0'?><Document>", ".csv", "Logger Pro"),
        (b"<!DOCTYPE html>", ".mat", "a web page"),
        (b"version https://git-lfs.github.com/spec/v1", ".tdms", "git lfs pull"),
        (b"t,F\n0,1\n", ".tdms", "does not start as a .tdms file does"),
        (b"t,F\n0,1\n", ".xyz", ".mcap"),
    ],
)
def test_a_file_that_is_not_what_its_ending_says_is_named_with_a_remedy(
    tmp_path: Path, start: bytes, ending: str, words: str
) -> None:
    (tmp_path / f"a{ending}").write_bytes(start + bytes(600))
    assert words in refusal(tmp_path / f"a{ending}")


def test_archives_are_told_from_workbooks(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "a.csv", "w") as archive:
        archive.writestr("run.csv", "t,F\n0,1\n")
    with zipfile.ZipFile(tmp_path / "b.csv", "w") as archive:
        archive.writestr("xl/workbook.xml", "<workbook/>")
    (tmp_path / "c.csv.gz").write_bytes(gzip.compress(b"t,F\n0,1\n"))
    assert "a ZIP archive; unpack it" in refusal(tmp_path / "a.csv")
    assert "an Excel workbook; rename it to .xlsx" in refusal(tmp_path / "b.csv")
    assert "a gzip archive; unpack it" in refusal(tmp_path / "c.csv.gz")


@pytest.mark.parametrize("ending", [".mat", ".h5", ".tdms", ".mf4", ".bag", ".csv", ".xlsx"])
def test_an_empty_file_is_called_empty(tmp_path: Path, ending: str) -> None:
    (tmp_path / f"a{ending}").touch()
    assert "is empty" in refusal(tmp_path / f"a{ending}")


def test_missing_files_and_folders_are_refused(tmp_path: Path) -> None:
    assert "does not exist" in refusal(tmp_path / "a.tdms")
    assert "is a folder" in refusal(tmp_path)


def test_an_unreadable_file_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise PermissionError(13, "Permission denied")

    (tmp_path / "a.tdms").write_bytes(b"TDSm")
    monkeypatch.setattr(Path, "open", refuse)
    assert "cannot be read (Permission denied)" in refusal(tmp_path / "a.tdms")


@pytest.mark.parametrize(
    ("module", "name", "start"),
    [("nptdms", "a.tdms", b"TDSm"), ("asammdf", "a.mf4", b"MDF     "), ("rosbags.highlevel", "a.bag", b"#ROSBAG V2.0")],
)
def test_a_missing_library_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, module: str, name: str, start: bytes
) -> None:
    (tmp_path / name).write_bytes(start)
    monkeypatch.setitem(sys.modules, module, None)
    assert "pip install 'bowdenfit[lab]'" in refusal(tmp_path / name, read_here)


@pytest.mark.parametrize("name", ["plain.mat", "packed.mat", "modern.mat", "a.h5", "a.bag", "a.tdms"])
def test_a_file_too_large_for_the_memory_is_refused_before_it_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    {**WRITERS, "a.tdms": write_tdms}[name](tmp_path / name)
    monkeypatch.setattr(channels, "LARGEST_BYTES", 2000)
    assert "decimate it" in refusal(tmp_path / name, read_here)


def test_a_packed_structure_is_measured_before_it_is_unpacked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scipy.io.savemat(tmp_path / "a.mat", {"rec": {"F": np.zeros(10**5)}}, do_compression=True)
    assert (tmp_path / "a.mat").stat().st_size < 10**4
    monkeypatch.setattr(channels, "LARGEST_BYTES", 4 * 10**5)
    assert "decimate it" in refusal(tmp_path / "a.mat", read_here)


def test_an_mdf_file_too_large_is_refused(mf4: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(channels, "LARGEST_BYTES", 2000)
    assert "decimate it" in refusal(mf4, read_here)


CMBL = """<Document><DataSet><DataSetName>Latest</DataSetName>
<DataColumn><DataObjectName>Time</DataObjectName><ColumnUnits>s</ColumnUnits><ColumnCells>
0
0.02
0.04
</ColumnCells></DataColumn>
<DataColumn><DataObjectName>Force</DataObjectName><ColumnUnits>N</ColumnUnits><ColumnCells>
1.5
Z1
-2.25
</ColumnCells></DataColumn></DataSet>{more}</Document>"""


def test_a_logger_pro_file_gives_its_columns_with_units_and_clock(tmp_path):
    path = tmp_path / "run.cmbl"
    path.write_text(CMBL.format(more=""))
    file = read_channels(path)
    assert [(c.name, c.unit) for c in file.channels] == [("Time", "s"), ("Force", "N")]
    np.testing.assert_array_equal(file.channels[1].values, [1.5, np.nan, -2.25])
    np.testing.assert_array_equal(file.channels[1].time, [0.0, 0.02, 0.04])


def test_several_logger_pro_runs_keep_their_names_apart(tmp_path):
    path = tmp_path / "run.cmbl"
    second = CMBL.format(more="")[len("<Document>") : -len("</Document>")].replace("Latest", "Run 1")
    path.write_text('<?xml version="1.0"?>' + CMBL.format(more=second))
    assert [c.name for c in read_channels(path).channels] == [
        "Latest/Time",
        "Latest/Force",
        "Run 1/Time",
        "Run 1/Force",
    ]


@pytest.mark.parametrize("text", [CMBL[:200], '<!DOCTYPE a [<!ENTITY b "c">]>' + CMBL, "<Document></Document>"])
def test_a_damaged_hostile_or_empty_logger_pro_file_is_refused_in_a_sentence(tmp_path, text):
    path = tmp_path / "run.cmbl"
    path.write_text('<?xml version="1.0"?>' + text.replace("{more}", ""))
    with pytest.raises(DatasetError, match=r"run\.cmbl .*\.$"):
        read_channels(path)
