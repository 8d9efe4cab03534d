"""Each verb once, as somebody types it: it ends with exit code 0 and prints what it is asked for."""

import json
import shutil

import pytest
from pooled_fleets import fleet_draws

from bowdenfit import verbs
from bowdenfit.addons.fleet.folder import CHECKSUM, FLEET_DRAWS, FLEET_PAGE, FLEET_TABLE, write_fleet_draws
from bowdenfit.results.answer_cache import file_checksum

TABLE = "input_force_N,output_force_N\n10,8\n20,16.1\n30,23.9\n40,32.1\n50,39.9\n60,48.1\n"
COMMANDS = {  # what is typed behind each verb, and a word of what it prints
    "check": (("DATASETS/on-body-exoskeleton",), "efficiencies"),
    "fit": (("TMP/table.csv", "--wrap-angle=180deg", "--no-mcmc", "--no-figures", "-o", "TMP/fit"), "mu"),
    "summary": (("FIT",), "cut the cable to"),
    "predict": (("FIT", "470"), "470"),
    "length": (("FIT",), "mm"),
    "identify": (("FIT",), "mu1"),
    "next": (("FIT", "--top", "2"), "next, after remounting the cable"),
    "watch": (("DATASETS/on-body-exoskeleton", "--until", "100mm"), "4 mountings: the best cable length"),
    "compare": (("FIT", "OTHER"), "predict"),
    "compensate": (("LOOP", "--device", "DATASETS/haptic-teleoperation/device.toml"), "friction"),
    "teleoperate": (("LOOP", "DATASETS/haptic-teleoperation/device.toml"), "wall"),
    "export": (("FIT", "--to", "csv", "-o", "TMP/exported"), "exported"),
    "calibrate": (("DATASETS/yarn-on-cylinder", "-n", "2", "--seed", "1", "-o", "TMP/calibration"), ""),
    "fleet": (("TMP/fleet", "--seed", "1", "-o", "TMP/fleet-fit"), "every one fitted"),
    "pool": (("TMP/pooled", "--seed", "1"), ""),
    "plot": (("FIT", "--figure", "coefficients", "-o", "TMP/figures"), "coefficients.png"),
    "report": (("FIT", "-o", "TMP/report.html"), "report.html"),
    "simulate": (("DATASETS/synthetic-bench/bench.toml", "--seed", "1", "-o", "TMP/simulated"), "simulated"),
    "schema": (("cable",), "friction_model"),
    "certificate": (("FIT", "DATASETS/../docs/files/laboratory.toml", "-o", "TMP/certified"), "expanded uncertainty"),
    "cell": (("DATASETS/../docs/files/cell.xml",), "input_gain_error_sd = 0.0012"),
    "metabolic": (("DATASETS/on-body-metabolic",), "than no exoskeleton"),
}
MAY_DOUBT = {"calibrate", "pool", "metabolic", "fit", "teleoperate"}  # of two replications, of least squares alone, ...


def test_every_verb_is_among_these():
    assert sorted(COMMANDS) == sorted(verb.command_name for verb in verbs.VERBS if not verb.serves)


@pytest.fixture(scope="module")
def places(tmp_path_factory, on_body, quick_results, loop_results):
    """Whatever stands in capitals in a command, and where that is."""
    folder = tmp_path_factory.mktemp("verbs")
    (folder / "table.csv").write_text(TABLE)
    shutil.copytree(quick_results, folder / "other")
    fleet = on_body.with_name("synthetic-fleet")
    shutil.copytree(fleet / "readings", folder / "fleet" / "readings")
    shutil.copy(fleet / "fleet.toml", folder / "fleet")
    lines = (fleet / FLEET_TABLE).read_text().splitlines()
    (folder / "fleet" / FLEET_TABLE).write_text("\n".join(lines[:4]) + "\n")
    (folder / "pooled").mkdir()
    write_fleet_draws(folder / "pooled" / FLEET_DRAWS, fleet_draws(3, cables=4, draws=256)[0])
    (folder / "pooled" / FLEET_PAGE).write_text(json.dumps({CHECKSUM: file_checksum(folder / "pooled" / FLEET_DRAWS)}))
    return {"DATASETS": on_body.parent, "FIT": quick_results, "OTHER": folder / "other", "LOOP": loop_results, "TMP": folder}


@pytest.mark.extended
@pytest.mark.parametrize("verb", COMMANDS)
def test_each_verb_does_what_it_is_for(run, places, verb):
    arguments, word = COMMANDS[verb]
    for name, place in places.items():
        arguments = [argument.replace(name, str(place), 1) if argument.startswith(name) else argument for argument in arguments]
    code, out, err = run(verb, *arguments)
    assert code in ({0, 3} if verb in MAY_DOUBT else {0}), err
    assert word in out + err
