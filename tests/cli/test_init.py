"""From files of some laboratory to a data set that `check` accepts: by questions, or refused with all that is not said."""

import os
import shutil
import signal
import sys
import tomllib
from functools import partial
from pathlib import Path

import pexpect
import pytest

import bowdenfit as bf
from bowdenfit.errors import BowdenfitError, UsageError
from bowdenfit.models import build_model
from bowdenfit.questions.start.describe import format_toml, write_description
from bowdenfit.questions.start.folder import find_examples, new_folder
from bowdenfit.questions.start.question import coefficient_name_question, quantity_question

CORPUS = Path(__file__).parents[1] / "files" / "corpus"
ANGLES = """Measured in March;;
Seillaenge [mm];Winkel Mantel [deg];Winkel Knie [deg]
430;12,5;90
450;20;75
470;38;60
490;55;41
510;70;20
530;86;
"""
FORCES = """L (cm);Kanal 1 [N];Kanal 2 [N];Montage Nr
44;50,1;39,2;1
44;100,3;78,0;1
47;50,2;38,1;2
47;100,1;75,2;2
50;50,0;36,2;3
50;99,8;72,5;3
"""
EFFICIENCIES = "length mm,eta mean\n440,78\n470,76\n500,73\n"
FOREIGN = {"eta.csv": EFFICIENCIES, "kraefte.csv": FORCES, "winkel.csv": ANGLES}


class Person:
    """Answers each question by words in it; anything else by its default, or as its example has it."""

    def __init__(self, **answers):
        self.answers, self.asked = answers, []

    def ask(self, question):
        self.asked.append(question)
        replies = next((replies for words, replies in self.answers.items() if words.replace("_", " ") in question.words), None)
        return question.read(replies or question.default or question.example)

    def say(self, sentence):
        pass

    def report(self, sentence):
        pass

    def settle(self):
        pass


@pytest.fixture
def foreign(tmp_path, monkeypatch):
    """A folder with three files whose headings say little."""
    folder = tmp_path / "bench"
    folder.mkdir()
    for name, text in FOREIGN.items():
        (folder / name).write_text(text)
    monkeypatch.chdir(folder)
    return folder


def described(folder, person, *names):
    """What check makes of the description that a person's answers give."""
    paths = [folder / name for name in names]
    (folder / "cable.toml").write_text(write_description(paths, "glove", person))
    return bf.read(folder)


def test_three_foreign_files_become_a_data_set_by_a_persons_answers(foreign):
    replies = {"eta_mean": "%", "force_at_the_motor": "1", "which_mounting": "1", "Blank_cells": "10 deg"}
    person = Person(**{"kraefte.csv has the columns": "3", "What_does_it_hold": "2"}, **replies)
    data = described(foreign, person, *FOREIGN)
    page = tomllib.loads((foreign / "cable.toml").read_text())
    assert page["route"] == {"variable": "cable_length", "unit": "mm", "range": [430, 530]}
    assert [(c["name"], c["friction"]) for c in page["contact"]] == [("mantel", "mu1"), ("knie", "mu2")]
    assert page["tables"]["angles"]["detection_limit"] == {"value": 10, "unit": "deg"}
    forces = next(table for table in data.measurements.tables if hasattr(table, "run_names"))
    assert forces.input_force[0] == 50.1 and forces.output_force[0] == 39.2
    assert forces.route.tolist() == [440, 440, 470, 470, 500, 500]
    assert forces.run_names == ("1", "2", "3")


def test_what_the_files_say_is_not_asked(on_body):
    person = Person()
    names = ("angles.csv", "efficiencies.csv", "forces.csv")
    paths = [on_body / name for name in names if (on_body / name).exists()]
    write_description(paths, "glove", person)
    replies = " ".join(question.words for question in person.asked)
    for settled in ("In which unit", "Which column", "What does it hold", "Blank cells"):
        assert settled not in replies


def test_a_unit_is_asked_for_without_any_default(foreign):
    person = Person(**{"kraefte.csv has the columns": "3"}, What_does_it_hold="2")
    described(foreign, person, *FOREIGN)
    units = [question for question in person.asked if question.words.startswith("In which unit")]
    assert [question.default for question in units] == [None]
    assert "eta mean" in units[0].words


@pytest.mark.parametrize("heading", ["rendement", "eta", "Wirkungsgrad", "efficiency", "eta mean"])
def test_a_unit_that_a_person_says_of_efficiencies_is_kept_whatever_they_are_called(foreign, heading):
    (foreign / "eta.csv").write_text(EFFICIENCIES.replace("eta mean", heading))
    data = described(
        foreign, Person(What_does_it_hold="2", In_which_unit="%", Blank_cells="10 deg"), "eta.csv", "winkel.csv"
    )
    (table,) = [table for table in data.measurements.tables if hasattr(table, "efficiency")]
    assert table.efficiency.tolist() == pytest.approx([0.78, 0.76, 0.73])


@pytest.mark.extended
@pytest.mark.parametrize("path", sorted(CORPUS.glob("*.*")), ids=lambda path: path.name)
def test_whatever_laboratories_write_becomes_a_data_set_that_check_accepts(path, tmp_path):
    if path.suffix == ".toml":
        return
    shutil.copy(path, tmp_path)
    data = described(tmp_path, Person(force_at_the_motor="2" if path.name == "unnamed_ends.csv" else "1"), path.name)
    assert data.measurements.tables


def test_where_nobody_can_be_asked_all_that_is_not_said_is_refused_and_nothing_written(foreign, refuse, tmp_path):
    replies = refuse("init", "cable", "--from", *FOREIGN, faults=2)
    assert "eta.csv does not say what it holds" in replies and "kraefte.csv does not say what it holds" in replies
    (foreign / "one.csv").write_text("F_in,F_out\n50,40\n60,48\n")
    replies = refuse("init", "cable", "--from", "one.csv", faults=2)
    assert "unit of its column 'F_in'; write it into the heading, such as 'F_in (N)'" in replies
    assert "'F_out'" in replies
    (foreign / "two.csv").write_text("F_in (N),F_out (N)\n50,40\n60,48\n")
    assert "no column of two.csv is a wrap angle; add one" in refuse("init", "cable", "--from", "two.csv")


@pytest.mark.parametrize(
    ("text", "replies"),
    [
        (
            "Winkel (deg),F_in (N),F_out (N)\n90,50,40\n180,60,38\n",
            "whether its column 'Winkel (deg)' is the wrap angle",
        ),
        ("humidity (%),wrap angle (deg)\n78,90\n60,180\n", "does not say what it holds"),
        ("wrap angle (deg),F_in (N),Cell B (N)\n90,50,40\n180,60,38\n", "does not say what it holds"),
        ("F_in (N),F_out (N)\n50,40\n60,48\n", "is a wrap angle; add one"),
    ],
)
def test_what_would_only_be_proposed_to_a_person_is_taken_from_nobody(foreign, refuse, text, replies):
    (foreign / "bench_90deg.csv").write_text(text)
    assert replies in refuse("init", "cable", "--from", "bench_90deg.csv")


def test_files_that_say_everything_need_nobody(run, foreign):
    (foreign / "one.csv").write_text("wrap angle (deg),F_in (N),F_out (N)\n90,50,40\n90,60,48\n180,50,32\n")
    code, out, err = run("init", "cable", "--from", "one.csv")
    assert (code, err) == (0, "")
    assert out.endswith("Next: bowdenfit fit cable\n(bowdenfit check cable says how every row was understood)\n")
    assert run("check", "cable")[0] == 0


def test_a_table_with_a_column_of_angles_is_fitted_without_a_description(run, foreign):
    (foreign / "one.csv").write_text(
        "wrap angle (deg),F_in (N),F_out (N)\n90,50,41.1\n90,60,49.7\n180,50,34.6\n180,80,54.6\n270,50,28.4\n"
    )
    code, out, err = run("fit", "one.csv", "--no-mcmc", "--no-figures")
    assert "mu" in out, err
    assert code in {0, 3}


def test_several_files_and_one_folder_are_told_apart_behind_from(run, foreign):
    (foreign / "a.csv").write_text("wrap angle (deg),F_in (N),F_out (N)\n90,50,40\n180,60,38\n")
    (foreign / "b.csv").write_text("wrap angle (deg),F_in (N),F_out (N)\n90,50,40\n180,60,38\n")
    assert run("init", "--from", "a.csv", "b.csv", "cable")[0] == 0
    assert {path.name for path in Path("cable").iterdir()} == {"a.csv", "b.csv", "cable.toml"}
    assert "does not exist" in run("init", "other", "--from", "a.csv", "c.csv")[2]


def test_rows_that_are_wrong_are_said_when_the_description_is_written(run, foreign):
    (foreign / "one.csv").write_text("wrap angle (deg),F_in (N),F_out (N)\n90,50,40\n90,-60,x\n")
    code, out, err = run("init", "cable", "--from", "one.csv")
    assert code == 2
    assert "Correct them in cable" in out
    assert "row 3, column 'F_in (N)'" in err and "row 3, column 'F_out (N)'" in err


def test_every_example_is_written_whole_and_accepted(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, listing, _ = run("init", "--example")
    assert code == 0
    assert listing.split() == list(find_examples()) and "on-body-exoskeleton" in listing
    for name in find_examples():
        code, out, _ = run("init", "--example", name)
        verb = {"synthetic-fleet": "fleet", "on-body-metabolic": "metabolic", "haptic-teleoperation": "device"}.get(name, "fit")
        following = "teleoperate RESULTS haptic-teleoperation/device.toml" if verb == "device" else f"{verb} {name}"
        assert (code, out) == (0, f"Wrote {name}. Next: bowdenfit {following}\n")
        assert run("check", name)[0] == (0 if verb == "fit" else 2)
    assert {"synthetic-fleet", "on-body-metabolic", "haptic-teleoperation"} < set(find_examples())
    assert "the folder holds a fleet: `bowdenfit fleet synthetic-fleet`" in run("check", "synthetic-fleet")[2]
    assert "did you mean 'on-body-exoskeleton'" in run("init", "--example", "on-body-exoskelton")[2]
    assert "exists already" in run("init", "--example", "yarn-on-cylinder")[2]


def test_a_folder_is_there_whole_or_not_at_all(tmp_path):
    with pytest.raises(KeyboardInterrupt), new_folder(tmp_path / "cable") as place:
        (place / "cable.toml").write_text("half")
        raise KeyboardInterrupt
    assert not list(tmp_path.iterdir())
    (tmp_path / "file").write_text("")
    with pytest.raises(BowdenfitError, match="exists already"), new_folder(tmp_path / "file"):
        pass


@pytest.mark.parametrize("typed", ["12", "deg", "-3 deg", "12 mm", "0 deg", "1e400 deg", ""])
def test_an_angle_that_is_none_is_refused_in_a_sentence(typed):
    with pytest.raises(UsageError, match=r"\.$"):
        quantity_question("Which angle?", "angle", "90 deg").read(typed)


@pytest.mark.parametrize(
    ("typed", "replies"),
    [
        ("", "the name is empty"),
        ("mu\u200b1", "cannot be printed"),
        ("m" * 81, "at most 80"),
        ("by group", "this is the name of the coefficient"),
        ("optimal_length", "another number"),
        ("knie_b", "another number"),
        ("displacement_zero_3", "another number"),
        ("NAME OF THE CABLE", "left from the template"),
    ],
)
def test_a_coefficient_is_not_called_what_check_would_refuse(typed, replies):
    with pytest.raises(UsageError, match=replies):
        coefficient_name_question("What is it called?", "mu1", ("knie",)).read(typed)


@pytest.mark.extended
def test_a_coefficient_may_be_called_what_check_accepts_and_never_what_a_fit_calls_something_else():
    question = coefficient_name_question("What is it called?", "mu1", ())
    names, of_columns = ("mu1", " µ  edge ", "knie_mu", "friction"), {"friction", "curve", "departure"}
    assert [question.read(name) for name in names] == ["mu1", "µ edge", "knie_mu", "friction"]
    for name in find_examples():
        if name in {"synthetic-fleet", "on-body-metabolic", "haptic-teleoperation"}:
            continue
        space = build_model(bf.read(find_examples()[name])).space
        remaining = [parameter.name for parameter in space.parameters if parameter.role not in of_columns]
        assert remaining, name
        for other in remaining:
            with pytest.raises(UsageError, match="another number"):
                question.read(other)


def test_a_name_that_is_refused_is_asked_for_again_before_anything_is_written(foreign):
    replies = {"eta_mean": "%", "force_at_the_motor": "1", "'knie' called": "tau"}
    with pytest.raises(UsageError, match="'tau' is what results call another number; write another name, such as mu2"):
        described(foreign, Person(**{"kraefte.csv has the columns": "3", "What_does_it_hold": "2"}, **replies), *FOREIGN)
    with pytest.raises(UsageError, match="write what the cable is called"):
        described(foreign, Person(cable_called="NAME OF THE CABLE", What_does_it_hold="2"), "eta.csv")


in_a_terminal = pytest.mark.filterwarnings("ignore:os.fork")  # the child is another program at once


class Console:
    """A real terminal of 80 columns in which the program runs."""

    def __init__(self, *arguments):
        self.child = pexpect.spawn(
            sys.executable,
            ["-m", "bowdenfit", *arguments],
            env={**os.environ, "PYTHONPATH": str(Path(bf.__file__).parents[1])},
            dimensions=(50, 80),
            encoding="utf-8",
            timeout=120,
            preexec_fn=partial(signal.signal, signal.SIGINT, signal.SIG_DFL),  # tests in the background are deaf to it
        )

    def answer(self, question, replies):
        self.child.expect(question)
        self.child.expect("> ")
        self.child.sendline(replies)

    def end(self):
        self.child.expect(pexpect.EOF)
        self.child.close()
        return self.child.exitstatus


@pytest.mark.extended
@in_a_terminal
def test_in_a_terminal_three_foreign_files_become_a_fit_without_an_editor(foreign):
    console = Console("init")
    console.answer("Which folder should be written", "")
    console.answer("Which files did you measure", "")
    console.answer("What does it hold", "2")
    console.answer("What does it hold", "")
    console.answer("What is the cable called", "Glove")
    console.answer("Who measured it", "")
    console.answer("is the efficiency", "")
    console.answer("In which unit is the column 'eta mean'", "furlong")
    console.answer("does not measure a ratio", "%")
    console.answer("is the force at the motor", "")
    console.answer("An answer is needed here", "1")
    console.answer("is the force at the load", "")
    console.answer("says which mounting", "1")
    console.answer("Between which lengths", "")
    console.answer("can be bought", "440 460 480 500 520")
    for place in ("mantel", "knie"):
        console.answer(f"What is the place called.*{place}", "")
        console.answer("follow the length", "")
    console.answer("Below which angle", "10 deg")
    console.answer("kraefte.csv is the length", "")
    console.answer("another place", "")
    console.answer("'mantel' called", "")
    console.answer("'knie' called", "mu1")
    console.child.expect("Next: bowdenfit fit my-cable")
    assert console.end() == 0
    fit = Console("fit", "my-cable", "--no-mcmc", "--no-figures")
    fit.child.expect("Glove")
    fit.child.expect("Wrote fits/my-cable")
    assert fit.end() in {0, 3}


@pytest.mark.extended
@in_a_terminal
@pytest.mark.parametrize("key", ["c", "d"])
def test_ctrl_c_and_ctrl_d_end_a_dialog_without_a_trace(foreign, key):
    files_at_start = sorted(foreign.rglob("*"))
    console = Console("init", "cable")
    console.answer("Which files did you measure", "")
    console.child.expect("What does it hold")
    console.child.expect("> ")
    console.child.sendcontrol(key)
    console.child.expect("Interrupted.")
    assert console.end() == 130
    assert sorted(foreign.rglob("*")) == files_at_start


@in_a_terminal
def test_a_folder_that_exists_is_refused_before_the_first_question(foreign):
    console = Console("init", str(foreign))
    console.child.expect("exists already")
    assert "?" not in console.child.before
    assert console.end() == 2


@pytest.mark.parametrize(
    "page",
    [
        {
            "schema": 1,
            "name": 'a "cable"\\ \u00e4',
            "contact": [{"name": "a", "angle": {"value": 1e-7, "unit": "deg"}}] * 2,
        },
        {
            "tables": {
                "forces": {"file": "f.csv", "columns": {f"key {i}": {"name": f"Kanal {i}"} for i in range(9)}},
                "a": {},
            }
        },
        {"tables": {"recordings": {}}, "route": {"range": [0.1, 3], "choices": [i / 3 for i in range(60)]}},
    ],
)
def test_what_is_written_is_what_is_read(page):
    def close(value):
        if isinstance(value, float):
            return float(f"{value:.12g}")
        if isinstance(value, dict):
            return {key: close(inside) for key, inside in value.items()}
        return [close(inside) for inside in value] if isinstance(value, list) else value

    assert tomllib.loads(format_toml(page, {"route": "a remark"})) == close(page)


def test_a_range_beyond_the_measured_lengths_is_refused(foreign):
    replies = {"eta_mean": "%", "force_at_the_motor": "1", "Between_which": "400 530"}
    with pytest.raises(UsageError, match="angles were measured from 430 to 530 mm only"):
        described(foreign, Person(**{"kraefte.csv has the columns": "3", "What_does_it_hold": "2"}, **replies), *FOREIGN)
