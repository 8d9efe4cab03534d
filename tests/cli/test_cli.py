"""The command line as people use it: verbs, output, exit codes."""

import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import bowdenfit as bf
from bowdenfit import verbs
from bowdenfit.cli import running
from bowdenfit.cli.running import watch_verb
from bowdenfit.inference.chain import Progress
from bowdenfit.verbs import FIT

ROOT = Path(__file__).parents[2]
QUICK = ("sampler.n_walkers=64", "sampler.target_ess=200", "sampler.target_r_hat=1.05", "sampler.max_steps=4000")
ASKING = tuple(verb.command_name for verb in verbs.VERBS if not verb.serves)
VERBS = ("init", *(verb.command_name for verb in verbs.VERBS), "completion")
OF_LIBRARIES = ("JAX_", "XLA_", "MPL", "OMP_")  # what variables begin with that tell libraries what to do


@pytest.fixture(scope="module")
def results(quick_results):
    """A quick, converged fit with everything in its folder."""
    return quick_results


def test_help_names_every_verb_and_the_exit_codes(run):
    code, out, _ = run("--help")
    assert code == 0
    for verb in VERBS:
        assert re.search(rf"^ +{verb} ", out, re.M), verb
    assert "130" in out


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_explains_itself(run, verb):
    code, out, _ = run(verb, "--help")
    assert code == 0
    assert len(out.splitlines()) > 5
    assert not [line for line in out.splitlines() if len(line) > 80 or "\\" in line]


def test_the_program_alone_shows_its_help_and_that_something_is_missing(run):
    code, out, err = run()
    assert (code, err) == (2, "")
    assert out == run("--help")[1]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("fit", "x", "--seet", "1"), "Unknown option: --seet. Did you mean --sheet? See bowdenfit fit --help."),
        (("fti",), 'Unknown command "fti". Did you mean "fit"?'),
        (("fit", "x", "y"), "Unexpected argument y. See bowdenfit fit --help."),
        (("fit", "x", "--noise", "none"), '"none" for --noise. Choose from: "normal", "student".'),
        (("fit", "x", "--seed", "1.5"), "--seed = '1.5' must be a whole number from 0 to 2147483647."),
        (("next", "x", "--top", "0"), "--top = '0' must be a whole number from 1."),
        (("next", "x", "--cost", "angle"), "--cost 'angle' is not a kind and a number; write it as angle=0.5."),
        (("export", "x"), "--to requires an argument"),
    ],
)
def test_what_cannot_be_meant_is_refused_with_the_nearest_or_what_to_write(run, arguments, words):
    code, out, err = run(*arguments)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith("Error: ") and words in err


@pytest.mark.extended
def test_options_stand_anywhere_and_one_that_counts_once_is_refused_twice(run, results):
    call = ("--json", "455", "18", "in", "--stroke=pull", "--", "470")
    assert run("predict", results, *call) == run("predict", results, "455", "18in", "470", "--json")
    code, out, err = run("predict", results, "455", "--stroke", "return", "--stroke=pull")
    assert (code, out) == (2, "")
    assert "--stroke is given twice, and only one can count; leave one out." in err


@pytest.mark.parametrize("verb", ASKING)
def test_every_verb_says_what_to_name_where_nothing_is(run, verb):
    code, out, err = run(verb)
    assert (code, out) == (2, "")
    assert re.search(r"Missing argument '[A-Z]+(\.\.\.)?'\. Name (one|some), such as .+\.$", err), err


def test_a_sampler_is_refused_where_nothing_is_sampled(run, on_body):
    code, out, err = run("fit", on_body, "--no-mcmc", "--sampler", "nuts")
    assert (code, out) == (2, "")
    assert "leave one of them out" in err


def test_init_writes_a_template_once(run, tmp_path):
    folder = tmp_path / "my-cable"
    assert run("init", folder)[0] == 0
    written = {p.name: p.read_text() for p in folder.iterdir()}
    assert set(written) == {"cable.toml", "angles.csv", "forces.csv"}
    code, _, err = run("init", folder)
    assert code == 2
    assert "exists already" in err
    assert {p.name: p.read_text() for p in folder.iterdir()} == written


def test_the_template_becomes_a_data_set_by_filling_in(run, tmp_path):
    run("init", tmp_path / "cable")
    folder = tmp_path / "cable"
    rows = [f"{length},{angle}" for length, angle in ((430, 12), (460, 25), (490, 44), (520, 80))]
    (folder / "angles.csv").write_text((folder / "angles.csv").read_text() + "\n".join(rows) + "\n")
    described = (folder / "cable.toml").read_text()
    filled = {"NAME OF THE CABLE": "glove", "WHO MEASURED IT, WHEN, ON WHICH BENCH": "we"}
    numbers = {"SHORTEST": 430, "LONGEST": 520, "WRAP ANGLE": 45}
    for left, right in (*((f'"{k}"', f'"{v}"') for k, v in filled.items()), *((f'"{k}"', str(v)) for k, v in numbers.items())):
        described = described.replace(left, right)
    (folder / "cable.toml").write_text(described)
    forces = [
        f"{length},{run_},pull,{50 + i},{40 + i}" for length, run_ in ((440, 1), (480, 2), (520, 3)) for i in range(3)
    ]
    (folder / "forces.csv").write_text((folder / "forces.csv").read_text() + "\n".join(forces) + "\n")
    code, out, err = run("check", folder)
    assert (code, err) == (0, "")
    assert "Everything could be read" in out


def test_summary_prints_what_the_fit_wrote(run, results):
    code, out, _ = run("summary", results)
    assert code == 0
    assert out == (results / "summary.txt").read_text()
    code, out, _ = run("summary", results, "--json")
    assert json.loads(out) == bf.load(results).summary()
    code, out, _ = run("summary", results, "--full")
    assert (code, out) == (0, (results / "details.txt").read_text())
    assert "Verdict: converged" in out


def test_length_gives_the_design_answer(run, results):
    code, out, _ = run("length", results)
    assert code == 0
    assert re.match(r"Cut the cable to 470 mm\.\nAny cable length from 4[567]\d to 4[78]\d mm is good enough", out)
    assert re.search(r"\nThe best cable length is 4[67]\d mm \(90 % interval", out)
    code, out, _ = run("length", results, "--json")
    page = json.loads(out)
    assert page["unit"] == "mm"
    assert sum(c["probability_best"] for c in page["choices"]) == pytest.approx(1.0)


def test_predict_marks_lengths_outside_the_range(run, results):
    code, out, _ = run("predict", results, "470", "550", "--csv")
    assert code == 0
    heads, inside, outside = (line.split(",") for line in out.splitlines())
    assert heads[0] == "cable_length_mm"
    assert inside[heads.index("in_range")] == "true"
    assert outside[heads.index("in_range")] == "false"
    assert (
        float(inside[heads.index("q05")]) < float(inside[heads.index("efficiency")]) < float(inside[heads.index("q95")])
    )


def test_predictions_are_a_page_with_units_for_people(run, results):
    code, out, _ = run("predict", results, "470", "550")
    assert code == 0 and all(len(line) <= 80 for line in out.splitlines())
    first, table, notes = out.split("\n\n")
    heads, _, inside, outside = table.splitlines()
    assert re.match(r"Efficiency, inside the curves: 7\d\.\d % at 470 mm\.", first)
    within = run("predict", results, "470", "500")[1]
    assert re.match(r"Efficiency: highest 7\d\.\d % at 470 mm, lowest \d\d(\.\d)? % at 500 mm\.", within)
    assert heads.split("  ")[0] == "cable length (mm)" and inside.startswith("470 ") and outside.startswith("550 ")
    assert "550 mm: outside the curves, 430 to 530 mm: by the wrap angles measured there" in " ".join(notes.split())
    assert re.match(r"Efficiency at 470 mm: 7\d\.\d % \(90 % interval ", run("predict", results, "470")[1])


def test_lengths_are_read_with_their_units(run, results):
    by_unit = json.loads(run("predict", results, "455mm", "18", "in", "0.47", "m", "470", "1.8e1in", "--json")[1])
    assert [row["cable_length_mm"] for row in by_unit] == pytest.approx([455, 457.2, 470, 470, 457.2])
    for wrong, words in ((["lots"], "is not a number"), (["470", "foo"], "is not known"), (["470N"], "cannot be converted")):
        code, _, err = run("predict", results, *wrong)
        assert code == 2 and words in err
    code, _, err = run("predict", results, "470", "--csv", "--json")
    assert code == 2 and "name one of them" in err


def test_no_place_outside_the_curves_is_said_to_be_the_best_and_no_length_is_negative(run, results):
    assert run("predict", results, "455", "480", "550")[1].startswith("Efficiency, inside the curves: highest")
    assert run("predict", results, "455", "550")[1].startswith("Efficiency, inside the curves: 78.")
    assert run("predict", results, "540", "550")[1].startswith("Efficiency, all outside the curves: highest")
    code, _, err = run("predict", results, "--", "-455")
    assert code == 2
    assert "-455 mm: no cable length is negative where the route goes from 430 to 530 mm" in " ".join(err.split())


def test_predicted_forces_scale_with_the_input_and_turn_with_the_stroke(run, results):
    def forces(*options):
        return json.loads(run("predict", results, "470", "--json", "--input-force", *options)[1])[0]

    pull, pull_in_pounds, back = forces("100N"), forces("22.480894lbf"), forces("100 N", "--stroke", "return")
    assert pull["output_force_N"] < 100 < back["output_force_N"]
    assert pull_in_pounds["output_force_N"] == pytest.approx(pull["output_force_N"], rel=1e-6)
    assert pull["output_force_N"] * back["output_force_N"] == pytest.approx(1e4, rel=1e-3)
    assert pull["mounting_q05"] < pull["q05"] < pull["q95"] < pull["mounting_q95"]


@pytest.mark.parametrize(
    "arguments",
    [
        ("--input-force", "100"),
        ("--input-force", "100deg"),
        ("--input-force=-5N",),
        ("--input-force", "lots"),
        ("--stroke", "push"),
    ],
)
def test_impossible_predictions_are_refused_in_a_sentence(run, results, arguments):
    code, out, err = run("predict", results, "470", *arguments)
    assert (code, out) == (2, "")
    assert "Traceback" not in err
    assert "Error: " in err


def test_plot_draws_the_figures_again(run, results, tmp_path):
    code, out, _ = run("plot", results, "--output", tmp_path / "figures")
    assert code == 0
    names = {Path(line).name for line in out.split()}
    assert {"efficiency.png", "wrap_angles.png", "coefficients.png"} <= names
    assert names == {p.name for p in (tmp_path / "figures").iterdir()}


@pytest.mark.extended
def test_simulate_records_its_truth_and_its_seed(run, bench, tmp_path):
    assert run("simulate", bench, "--output", tmp_path / "a", "--seed", 5)[0] == 0
    assert run("simulate", bench, "--output", tmp_path / "b", "--seed", 5)[0] == 0
    for path in (tmp_path / "a").iterdir():
        assert path.read_bytes() == (tmp_path / "b" / path.name).read_bytes()
    page = json.loads((tmp_path / "a" / "truth.json").read_text())
    assert page["seed"] == 5
    assert page["truth"]["mu_sheath"] == 0.09
    assert run("check", tmp_path / "a")[0] == 0
    code, _, err = run("simulate", bench, "--output", tmp_path / "a")
    assert code == 2
    assert "exists already" in err


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_is_printed_for(run, shell):
    code, out, _ = run("completion", shell)
    assert code == 0
    assert "__complete" in out  # how the shell asks for what only the program knows, such as names of examples
    assert all(word in out for word in (*VERBS, "friction-limit", "karnopp"))


@pytest.mark.parametrize(
    ("words", "completed"),
    [
        (["ide"], {"identify"}),
        (["fit", "--sam"], {"--sampler"}),
        (["fit", "--sampler", ""], {"emcee", "nuts", "importance", "both"}),
        (["init", "--example", "on-body"], {"on-body-exoskeleton", "on-body-metabolic"}),
        (["check", "READ"], {"README.md"}),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_bash_completes_verbs_options_choices_examples_and_files(run, words, completed, tmp_path):
    (tmp_path / "completion").write_text(run("completion", "bash")[1])
    typed = " ".join(f"'{word}'" for word in words)
    script = f"""source {tmp_path / "completion"}
        bowdenfit() {{ {sys.executable} -m bowdenfit "$@"; }}
        COMP_WORDS=(bowdenfit {typed}); COMP_CWORD={len(words)}; _bowdenfit; printf '%s\n' "${{COMPREPLY[@]}}" """
    done = subprocess.run(["bash", "-c", script], cwd=ROOT, capture_output=True, text=True, check=True, timeout=60)
    assert set(done.stdout.split()) == completed, done.stderr


@pytest.mark.extended
def test_a_fit_that_has_not_converged_exits_with_3_and_says_why(run, on_body, tmp_path):
    few = ("max_steps=200", "n_ensembles=2", "n_walkers=32", "target_ess=300")
    settings = [option for key in few for option in ("--set", f"sampler.{key}")]
    code, out, err = run("fit", on_body, "--output", tmp_path / "fit", "--seed", 1, "--no-figures", *settings)
    assert code == 3
    assert "DO NOT USE THESE NUMBERS: the fit has not converged" in " ".join(out.split())
    assert "should be at least 300" in " ".join(run("summary", tmp_path / "fit", "--full")[1].split())
    assert (tmp_path / "fit" / "fit.json").exists()
    plot = ("plot", "--figure", "efficiency", "--format", "svg")
    reads = (("summary",), ("length",), ("predict",), ("predict", "455"), ("next", "--top", "1"), ("identify",))
    for call in (*reads, ("report",), (*plot, "--output", tmp_path / "drawn")):
        code, _, err = run(call[0], tmp_path / "fit", *call[1:])
        assert code == 3, call
        assert err.startswith("Warning: this fit is not converged") or call == ("summary",)  # whose first line it is


def test_a_missing_results_folder_is_a_sentence(run, tmp_path):
    for verb in ("summary", "length", "plot", "predict"):
        code, _, err = run(verb, tmp_path / "nowhere")
        assert code == 2
        assert err.count("\n") == 1
        assert "does not exist" in err


@pytest.mark.extended
def test_least_squares_alone_have_no_design_answer(run, on_body, tmp_path):
    code, out, _ = run("fit", on_body, "--no-mcmc", "--output", tmp_path / "fit", "--no-figures", "--json")
    assert code == 0
    page = json.loads(out)
    assert "optimal" not in page
    assert not page["parameters"]["squeezed_sheath_angle_c"]["least_squares"]["identified"]
    code, _, err = run("length", tmp_path / "fit")
    assert code == 2
    assert "--no-mcmc" in err


@pytest.mark.extended
def test_set_and_geometry_change_the_model(on_body):
    fixed = bf.fit(on_body, mcmc=False, settings=["friction.mu1.fixed=0.1"], geometry="published")
    assert fixed.summary()["parameters"]["mu1"]["fixed"] == 0.1
    assert fixed.summary()["geometry"] == "published"


def test_a_table_alone_needs_its_wrap_angle(run, tmp_path):
    table = tmp_path / "forces.csv"
    table.write_text(
        "input_force_N,output_force_N\n" + "\n".join(f"{f},{f * 0.8:.3f}" for f in range(10, 60, 5)) + "\n"
    )
    code, out, _ = run("check", table)
    assert code == 0
    assert "--wrap-angle" in out
    code, _, err = run("fit", table)
    assert code == 2
    assert "--wrap-angle" in err
    fit = bf.fit(table, wrap_angle=(180.0, "deg"), settings=(), mcmc=False)
    assert fit.least_squares.estimates["mu"].value == pytest.approx(-np.log(0.8) / np.pi, rel=1e-4)


def test_a_wrong_setting_of_a_lone_table_is_named_as_one(run, tmp_path):
    table = tmp_path / "bench.csv"
    table.write_text("input_force_N,output_force_N\n10,7\n20,14\n30,21\n")
    for setting, words in (("errors.wear=-1", "--set, errors.wear: input"), ("errors.wears=1", "--set: unknown key")):
        code, _, error = run("check", table, "--wrap-angle", "180deg", "--set", setting)
        assert code == 2 and words in error
        code, _, error = run("check", table, "--wrap-angle", "3000deg", "--set", setting)
        assert code == 2 and "--wrap-angle, contact" in error


def test_an_internal_error_is_a_sentence_with_a_request(run, monkeypatch, on_body):
    monkeypatch.setattr("bowdenfit.questions.check.check_data_set", lambda *_, **__: 1 / 0)
    for name in [name for name in os.environ if name.startswith(OF_LIBRARIES)]:
        monkeypatch.delenv(name)
    code, _, err = run("check", on_body)
    assert code == 1
    assert "). This is our fault: please report it" in err
    assert "Traceback" not in err


@pytest.mark.extended
@pytest.mark.parametrize(("setting", "value"), [("JAX_PLATFORMS", "abacus"), ("JAX_DISABLE_JIT", "1")])
def test_a_setting_of_a_library_that_it_cannot_work_with_is_named(bench, setting, value):
    command = [sys.executable, "-m", "bowdenfit", "identify", str(bench)]
    usual = {name: text for name, text in os.environ.items() if not name.startswith(OF_LIBRARIES)}
    call = usual | {"OMP_NUM_THREADS": "1", setting: value}
    done = subprocess.run(command, cwd=ROOT, env=call, capture_output=True, text=True, check=False, timeout=60)
    assert (done.returncode, done.stdout) == (1, "")
    assert f" {setting} in the environment may be the cause: unset it, and run the command again." in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.extended
def test_flags_that_would_end_the_process_in_words_of_xla_are_refused(run, refuse, monkeypatch, bench):
    monkeypatch.setenv("XLA_FLAGS", "--xla_cpu_use_fusion_emitters=false --nonsense")
    assert "XLA_FLAGS in the environment holds '--nonsense', and flags of XLA begin with --xla_;" in refuse("identify", bench)
    assert run("identify", "--help")[0] == 0
    monkeypatch.setenv("XLA_FLAGS", "--xla_cpu_use_fusion_emitters=false")
    assert run("identify", bench)[0] in (0, 3)


def test_a_watched_loop_that_is_interrupted_says_how_to_go_on(tmp_path, monkeypatch):
    (tmp_path / "chain.checkpoint").touch()
    requested = threading.Event()
    monkeypatch.setattr(running, "requested", requested)
    with pytest.raises(KeyboardInterrupt, match=r"the checkpoint is kept in .*: run the same command with --resume"):  # noqa: SIM117
        with watch_verb(tmp_path, FIT.watch) as report:
            report(Progress(200, 4000, None, None))
            requested.set()
            report(Progress(400, 4000, None, None))


@pytest.mark.extended
def test_a_whole_fit_in_a_process_of_its_own_and_an_interrupt(on_body, tmp_path):
    """The real thing once: a spawned command line that is interrupted, resumed, and finishes with figures."""
    command = [
        sys.executable,
        "-m",
        "bowdenfit",
        "fit",
        str(on_body),
        "--output",
        str(tmp_path / "fit"),
        "--seed",
        "2",
    ]
    settings = [f"--set={key}" for key in (*QUICK, "sampler.target_ess=100000", "sampler.max_steps=200000")]
    environment = os.environ | {"XDG_CACHE_HOME": str(tmp_path / "cache"), "JAX_COMPILATION_CACHE_DIR": ""}
    # A shell that runs the tests in the background makes its children deaf to interrupts; this one hears again.
    hear = "import os, signal, sys; signal.signal(signal.SIGINT, signal.SIG_DFL); os.execv(sys.argv[1], sys.argv[1:])"
    listening = [sys.executable, "-c", hear, *command, *settings]
    with subprocess.Popen(listening, cwd=ROOT, env=environment, stderr=subprocess.PIPE, text=True) as process:
        try:
            checkpoint, deadline = tmp_path / "fit" / "chain.checkpoint", time.monotonic() + 120
            while time.monotonic() < deadline and not (checkpoint.exists() and checkpoint.stat().st_size > 500_000):
                time.sleep(0.2)
            process.send_signal(signal.SIGINT)
            _, err = process.communicate(timeout=60)
        finally:
            process.kill()
    assert process.returncode == 130
    assert "--resume" in err
    assert "Traceback" not in err
    assert {p.name for p in (tmp_path / "fit").iterdir()} - {".lock"} == {"chain.checkpoint"}
    resumed = [*command, "--resume", *(f"--set={key}" for key in QUICK)]
    finished = subprocess.run(resumed, cwd=ROOT, capture_output=True, text=True, check=False, timeout=300)
    assert finished.returncode == 0, finished.stderr
    names = {p.name for p in (tmp_path / "fit").iterdir()}
    expected = {"fit.json", "summary.json", "summary.txt", "details.txt", "report.html", "answers.json", "figures.npz"}
    assert names == expected | {"posterior.nc", "figures"}
    assert len(list((tmp_path / "fit" / "figures").iterdir())) == 8  # seven, and their captions


@pytest.mark.parametrize(
    "command", [("check", "DATA", "--prior-predictive"), ("identify", "DATA", "--output")], ids=["check", "identify"]
)
def test_figures_for_a_place_that_cannot_be_written_are_refused_in_a_sentence(on_body, tmp_path, run, command):
    (tmp_path / "file").write_text("")
    code, _, err = run(*(on_body if part == "DATA" else part for part in command), tmp_path / "file" / "folder")
    assert code == 2
    assert "cannot be written" in err


def test_notes_in_a_results_folder_are_left_alone_and_other_files_stop_a_fit(on_body, tmp_path, run):
    notes = tmp_path / "fit" / "README.md"
    notes.parent.mkdir()
    notes.write_text("what I think of it")
    arguments = ("fit", on_body, "--no-mcmc", "--no-figures", "--output", notes.parent)
    assert run(*arguments)[0] == 0
    assert run(*arguments, "--force")[0] == 0
    assert notes.read_text() == "what I think of it"
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "thesis.tex").write_text("")
    code, _, err = run("fit", on_body, "--no-mcmc", "--output", tmp_path / "other")
    assert code == 2
    assert "is not a results folder" in err


@pytest.mark.parametrize(("verb", "wrong", "right"), [(bf.fit, "sede", "seed"), (bf.read, "fricton", "friction")])
def test_a_misspelled_keyword_is_refused_with_the_nearest(on_body, verb, wrong, right):
    with pytest.raises(bf.UsageError, match=f"no keyword '{wrong}'; did you mean '{right}'"):
        verb(on_body, **{wrong: 1})
