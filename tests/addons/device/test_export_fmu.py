"""The functional mock-up unit, driven by fmpy, against the C header compiled by itself."""

import shutil
import subprocess
import sys
import zipfile
from dataclasses import replace

import numpy as np
import pytest
from exported_cables import HOSTILE, cable, motion

from bowdenfit.addons.device.fmu import build_fmu
from bowdenfit.errors import UsageError
from bowdenfit.questions.export.c import c_header

fmpy = pytest.importorskip("fmpy")
validation = pytest.importorskip("fmpy.validation")
pytestmark = [
    pytest.mark.extended,
    pytest.mark.skipif(not any(map(shutil.which, ("cc", "gcc", "clang"))), reason="no C compiler is installed"),
    pytest.mark.skipif(sys.platform != "linux", reason="made for Linux"),
    pytest.mark.filterwarnings("default"),  # of libraries that fmpy loads
]
DRIVER = r"""
#include <stdio.h>
#include "bowden.h"
int main(void)
{
    double in[5], out[6], state = NAN;
    while (fread(in, sizeof *in, 5, stdin) == 5) {
        int flags = 0, level = (int)in[4];
        out[0] = bowden_step(level, in[1], in[2], in[0], &state, &flags);
        out[1] = bowden_output(level, in[1], in[2], in[0], 1, 0);
        out[2] = bowden_output(level, in[1], in[2], in[0], -1, 0);
        out[3] = bowden_input(level, in[1], in[2], in[3], 1, 0);
        out[4] = bowden_input(level, in[1], in[2], in[3], -1, 0);
        out[5] = flags;
        fwrite(out, sizeof *out, 6, stdout);
    }
    return 0;
}
"""
OUTPUTS = (
    "output_force",
    "output_force_pulling",
    "output_force_returning",
    "input_force_pulling",
    "input_force_returning",
)


def in_c(computed, rows, folder):
    """What the header says, compiled with another compiler than the unit where there is one."""
    (folder / "bowden.h").write_text(c_header(computed))
    (folder / "driver.c").write_text(DRIVER)
    command = shutil.which("clang") or shutil.which("gcc") or "cc"
    subprocess.run([command, "-O1", "-ffp-contract=off", "-o", "driver", "driver.c", "-lm"], cwd=folder, check=True)
    replied = subprocess.run([folder / "driver"], input=rows.tobytes(), capture_output=True, check=True).stdout
    return np.frombuffer(replied).reshape(-1, 6)


def written(computed, folder, name="a cable"):
    path = folder / "cable.fmu"
    path.write_bytes(build_fmu(computed, name))
    return path


@pytest.mark.parametrize("case", ["loop", "load", "rate", "one place"])
def test_a_unit_driven_by_fmpy_says_what_c_says_to_the_last_bit(case, tmp_path):
    tables, n, level = cable(case), 2000, 3
    path = written(tables, tmp_path)
    assert validation.validate_fmu(str(path)) == []
    time, route_points = np.arange(n) * 1e-3, tables.points.values
    place = np.linspace(route_points[0] - 0.2, route_points[-1] + 0.2, n)
    names = ("time", "input_force", "place", "speed", "wanted_force")
    columns = (time, motion(tables, n), place, 40 * np.sin(7 * time), 20 + motion(tables, n))
    records = np.array(list(zip(*columns, strict=True)), dtype=[(name, float) for name in names])
    run = fmpy.simulate_fmu(
        str(path), validate=False, start_values={"level": level}, input=records, output=[*OUTPUTS, "flags"], stop_time=time[-1],
        output_interval=1e-3, step_size=1e-3, fmi_call_logger=None,
    )  # fmt: skip
    assert len(run) == n
    rows = np.column_stack([*columns[1:], np.full(n, level)])
    # inputs at a step's beginning: the row of t + h holds the play of t, and what follows at once from the inputs of t
    expected = in_c(tables, rows, tmp_path)
    for k, name in enumerate((*OUTPUTS, "flags")):
        np.testing.assert_array_equal(run[name][1:], expected[:-1, k], err_msg=name)
    assert np.ptp(run["output_force"]) > 50


def test_a_unit_can_be_reset_copied_and_told_wrong_things(tmp_path):
    tables = cable("rope")
    path = written(tables, tmp_path)
    description, folder = fmpy.read_model_description(str(path)), fmpy.extract(str(path), str(tmp_path / "unpacked"))
    made = fmpy.fmi2.FMU2Slave(
        guid=description.guid, unzipDirectory=folder, instanceName="x",
        modelIdentifier=description.coSimulation.modelIdentifier,
    )  # fmt: skip
    made.instantiate()
    made.setupExperiment()
    made.enterInitializationMode()
    made.exitInitializationMode()
    made.setReal([0, 1], [100.0, 1.0])
    made.doStep(0.0, 1e-3)
    (first,) = made.getReal([4])
    saved_state = made.getFMUState()
    made.setReal([0], [200.0])
    made.doStep(1e-3, 1e-3)
    assert made.getReal([4])[0] > first
    made.setFMUState(saved_state)
    assert made.getReal([4]) == [first]
    assert made.serializeFMUstate(made.deSerializeFMUstate(made.serializeFMUstate(saved_state))) == made.serializeFMUstate(
        saved_state
    )
    for wrong in (
        lambda: made.setInteger([0], [99]),
        lambda: made.setReal([0], [np.nan]),
        lambda: made.setReal([4], [1.0]),
    ):
        with pytest.raises(fmpy.fmi1.FMICallException):
            wrong()
    assert made.getReal([0, 4]) == [100.0, first]
    made.reset()
    assert made.getReal([0]) == [0.0]
    made.terminate()
    made.freeInstance()


def test_hostile_names_are_harmless_in_an_fmu(tmp_path):
    tables = cable("rope", name=HOSTILE)
    about = replace(tables.about, group=HOSTILE, distrust=HOSTILE, version=HOSTILE, created=HOSTILE)
    hostile = replace(tables, about=about, points=replace(tables.points, variable=HOSTILE, unit="<&\"'"))
    path = written(hostile, tmp_path, HOSTILE)
    assert validation.validate_fmu(str(path)) == []
    assert all(name.isascii() and ".." not in name for name in zipfile.ZipFile(path).namelist())


def test_an_fmu_says_where_it_is_from_and_is_the_same_each_time(tmp_path):
    path = written(cable("rope"), tmp_path)
    description = fmpy.read_model_description(str(path))
    assert description.generationTool == "bowdenfit 0.1.0, seed 7"
    assert all(
        words in description.description for words in ("test cable", "Range: wrap_angle", "Levels: q05, q50, q95")
    )
    assert path.read_bytes() == build_fmu(cable("rope"), "a cable")


def test_without_a_compiler_a_sentence_says_so(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)
    with pytest.raises(UsageError, match=r"no C compiler here: none of cc, gcc, clang is installed.*--to c"):
        build_fmu(cable("rope"), "x")
    monkeypatch.setenv("CC", "nocc -m64")
    with pytest.raises(UsageError, match="CC names nocc, which does not exist"):
        build_fmu(cable("rope"), "x")
    bad = tmp_path / "bad"
    bad.write_text("#!/bin/sh\necho 'x: error: it is broken' >&2\nexit 1\n")
    bad.chmod(0o755)
    monkeypatch.setenv("CC", str(bad))
    monkeypatch.setenv("PATH", "/usr/bin:/bin")
    with pytest.raises(UsageError, match="fails: x: error: it is broken"):
        build_fmu(cable("rope"), "x")
