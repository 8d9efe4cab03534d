"""Arrays that NumPy saved, and units that only the name of an array, variable or data set states."""

import h5py
import numpy as np
import pytest
import scipy.io

import bowdenfit as bf
from bowdenfit.files.formats import read_channels

TIME = np.arange(600) * 0.02
FORCE = 40 + 20 * np.sin(TIME)
COLUMNS = {"t_ms": 1000 * TIME, "F_in_N": FORCE, "F_out_N": 0.8 * FORCE}


def channels(path):
    return {channel.name: channel for channel in read_channels(path).channels}


def write_hdf5(path):
    with h5py.File(path, "w") as file:
        for name, values in COLUMNS.items():
            file[name] = values


@pytest.mark.parametrize(
    ("ending", "write"),
    [
        (".npz", lambda path: np.savez_compressed(path, **COLUMNS)),
        (".mat", lambda path: scipy.io.savemat(path, COLUMNS)),
        (".h5", write_hdf5),
    ],
)
def test_units_are_those_that_the_names_state(tmp_path, ending, write):
    write(tmp_path / f"a{ending}")
    read = channels(tmp_path / f"a{ending}")
    assert [read[name].unit for name in COLUMNS] == ["ms", "N", "N"]
    assert read["F_in_N"].rate == pytest.approx(50.0)
    np.testing.assert_allclose(read["F_out_N"].values, COLUMNS["F_out_N"])


@pytest.mark.parametrize("unit", ["degC", "dB", "counts", "%RH"])
def test_a_channel_in_a_unit_that_nothing_needs_does_no_harm(tmp_path, run, unit):
    force = 40 + 20 * np.sin(3 * TIME)
    with h5py.File(tmp_path / "a.h5", "w") as file:
        columns = ("t", TIME, "s"), ("F_in", force, "N"), ("F_out", 0.8 * force, "N"), ("other", 0 * TIME, unit)
        for name, values, of in columns:
            file[name] = values
            file[name].attrs["units"] = of
    _, out, err = run("check", tmp_path / "a.h5")
    assert "a recording" in out and "F_out" in out and not err


def test_an_archive_gives_vectors_columns_fields_and_a_rate(tmp_path):
    fields = np.rec.fromarrays([FORCE, TIME], names="in_N,t_s")
    np.savez(tmp_path / "a.npz", both=np.stack([FORCE, TIME], axis=1), rec=fields, fs=50.0, note="gauge")
    read = channels(tmp_path / "a.npz")
    assert set(read) == {"both[:,0]", "both[:,1]", "rec.in_N", "rec.t_s"}
    assert read["both[:,0]"].clock == "fs" and read["rec.in_N"].clock == "rec.t_s"
    np.save(tmp_path / "one.npy", np.stack([FORCE, TIME]))
    assert list(channels(tmp_path / "one.npy")) == ["one[0,:]", "one[1,:]"]


def test_objects_are_left_out_and_never_unpickled(tmp_path):
    np.savez(tmp_path / "a.npz", **COLUMNS, meta=np.array({"operator": "a"}, dtype=object))
    assert any("'meta'" in remark for remark in read_channels(tmp_path / "a.npz").remarks)
    np.savez(tmp_path / "none.npz", meta=np.array({"operator": "a"}, dtype=object))
    with pytest.raises(bf.DatasetError, match="no recording that can be read"):
        read_channels(tmp_path / "none.npz")


@pytest.mark.parametrize("share", [0.2, 0.9])
def test_an_archive_that_was_cut_off_is_refused(tmp_path, share):
    np.savez(tmp_path / "a.npz", **COLUMNS)
    content = (tmp_path / "a.npz").read_bytes()
    (tmp_path / "a.npz").write_bytes(content[: int(share * len(content))])
    with pytest.raises(bf.DatasetError, match=r"a\.npz"):
        read_channels(tmp_path / "a.npz")
