"""The questions of `init` as a form, and what is understood of files on their way to a data set."""

import tomllib

import openpyxl
import pytest

from bowdenfit.addons.app.data_set import read_seed
from bowdenfit.addons.app.draft import Draft
from bowdenfit.addons.app.form import Form, UnansweredError
from bowdenfit.cli.init_dialog import start_data_set
from bowdenfit.errors import UsageError
from bowdenfit.questions.start.question import number_question, quantity_question, yes_no_question

TABLE = "F_in (N),F_out (N),run\n20,15.2,1\n40,30.1,1\n20,15.0,2\n40,30.9,2\n20,14.8,3\n40,29.9,3\n"


@pytest.fixture
def draft_of(tmp_path):
    """Make a draft of some tables."""

    def make(**files):
        draft = Draft(tmp_path / "draft")
        draft.folder.mkdir()
        for name, content in files.items():
            draft.new_file(f"{name}.csv").write_text(content)
        return draft

    return make


def answer(draft, words, typed):
    """Answer the question that begins with some words."""
    (entry,) = [entry for entry in draft.understanding.entries if entry.words.startswith(words)]
    draft.answers[entry.key] = typed
    return draft.understand()


def test_a_form_goes_on_with_proposed_answers_and_ends_at_the_first_without_one():
    form = Form({})
    assert form.ask(yes_no_question("Is it so?", True)) is True
    with pytest.raises(UnansweredError):
        form.ask(quantity_question("How far?", "angle", "90 deg"))
    assert [(entry.words, entry.answer, entry.options) for entry in form.entries] == [
        ("Is it so?", "y", (("y", "yes"), ("n", "no"))),
        ("How far?", "", ()),
    ]


def test_the_same_question_asked_twice_has_two_answers():
    form = Form({"How many? 1": "2", "How many? 2": "3"})
    assert [form.ask(number_question("How many?", None)) for _ in range(2)] == [2, 3]


def test_an_answer_that_cannot_be_read_is_refused_in_the_words_of_the_terminal():
    form = Form({"How many? 1": "some"})
    with pytest.raises(UnansweredError):
        form.ask(number_question("How many?", None, example="3"))
    assert form.entries[0].fault == "'some' is not a number; write one, such as 3."


def test_the_folder_is_called_after_the_cable(draft_of):
    draft = draft_of(forces=TABLE)
    draft.understand()
    answer(draft, "By which angle", "180 deg")
    answer(draft, "What is the cable called?", "Knie: Prüfstand 2/3")
    assert draft.proposed_name == "Knie-Prüfstand-2-3"


def test_a_draft_is_understood_as_init_understands_it(draft_of, tmp_path):
    draft = draft_of(forces=TABLE)
    initial = draft.understand()
    assert list(map(initial.files[0].meaning_of, initial.files[0].columns)) == ["input_force", "output_force", "run"]
    assert (initial.files[0].columns[1].first, initial.files[0].columns[1].last) == ("15.2", "29.9")
    assert initial.report == initial.description == ""
    after = answer(draft, "By which angle", "180 deg")
    assert after.refusals == ()
    assert "Everything could be read" in after.report
    draft.write(tmp_path / "by-app")
    measured = tmp_path / "forces.csv"
    measured.write_text(TABLE)
    start_data_set(tmp_path / "by-init", [measured], None, {"wrap_angle": "180deg"})
    assert 'wrap_angle = { value = 180, unit = "deg" }' in (tmp_path / "by-app" / "cable.toml").read_text()
    assert (tmp_path / "by-app" / "forces.csv").read_text() == TABLE


def test_meaning_and_unit_of_a_column_can_be_stated(draft_of):
    draft = draft_of(forces="a,b,bend,trial\n20,15.2,90,1\n40,30.1,90,1\n20,13.0,180,2\n40,25.9,180,2\n")
    draft.state("forces.csv", "a", "input_force", "lbf")
    draft.state("forces.csv", "b", "output_force", "lbf")
    draft.state("forces.csv", "bend", "wrap_angle", "deg")
    understanding = draft.understand()
    if understanding.entries[0].words.startswith("forces.csv has the columns"):
        understanding = answer(draft, "forces.csv has the columns", "2")
    (file,) = understanding.files
    assert {column.name: (file.meaning_of(column), column.unit) for column in file.columns} == {
        "a": ("input_force", "lbf"), "b": ("output_force", "lbf"), "bend": ("wrap_angle", "deg"), "trial": ("", ""),
    }  # fmt: skip


def test_a_refusal_names_the_cell_that_it_speaks_of(draft_of):
    draft = draft_of(forces=TABLE.replace("30.9", "many"))
    draft.understand()
    refusal = next(r for r in answer(draft, "By which angle", "180 deg").refusals if r.row)
    assert (refusal.file, refusal.row, refusal.column) == ("forces.csv", 5, "F_out (N)")
    assert refusal.sentence.startswith("forces.csv, row 5, column 'F_out (N)': ")


def test_what_is_left_out_of_a_draft_stays_so_until_its_file_comes_again(draft_of):
    draft = draft_of(forces=TABLE.replace("30.9", "-30.9"))
    draft.understand()
    assert [refusal.row for refusal in answer(draft, "By which angle", "180 deg").refusals] == [5]
    draft.change_part("forces", "forces.csv", 5, "upside down")
    understanding = answer(draft, "What is the cable called?", "knee")
    assert tomllib.loads(understanding.description)["tables"]["forces"]["exclude"] == [{"rows": [5], "reason": "upside down"}]
    assert "1 reading left out by the user" in understanding.report
    draft.new_file("forces.csv", rows=5).write_text(f"{TABLE}20,15.1,4\n")
    assert draft.understand().description.count("upside down") == 1
    draft.change_part("forces", "forces.csv", 5, None)
    assert "exclude" not in draft.understand().description
    draft.change_part("forces", "forces.csv", 5, "upside down")
    draft.new_file("forces.csv").write_text(TABLE)
    assert "exclude" not in draft.understand().description
    with pytest.raises(UsageError, match="write why row 5 is left out"):
        draft.change_part("forces", "forces.csv", 5, " ")


def test_tables_and_a_workbook_become_one_table_and_other_headings_are_named(tmp_path):
    """Headings as a German bench writes them; the sheet is that of the workbook alone."""
    head = "Lauf;Kraft Motor (N);Kraft Last (N);Richtung;Umschlingungswinkel (°)"
    german = (head, "1;20,1;15,0;ziehen;90", "1;40,3;30,2;ziehen;90")
    (tmp_path / "a.csv").write_text("\n".join([*german, ""]), encoding="cp1252")
    book = openpyxl.Workbook()
    sheet = book.active
    sheet.title = "Kräfte"
    book.create_sheet("Notizen").append(["nothing"])
    for row in (["Lauf", "Kraft Motor", "Kraft Last", "Richtung", "Umschlingungswinkel"], ["", "N", "N", "", "°"],
                [7, 20.2, 11.9, "ziehen", 180], [8, 41.0, 23.8, "ziehen", 180]):  # fmt: skip
        sheet.append(row)
    book.save(tmp_path / "b.xlsx")
    draft = Draft(tmp_path)
    understanding = draft.understand()
    assert understanding.refusals == ()
    tables = tomllib.loads(understanding.description)["tables"]
    assert tables == {"forces": {"files": ["a.csv", "b.xlsx"], "sheet": "Kräfte"}}
    assert "4 force readings in 3 runs" in understanding.report
    sheet["E1"] = "Winkel"
    book.save(tmp_path / "b.xlsx")
    (refusal,) = draft.understand().refusals
    assert "wrap_angle is 'Umschlingungswinkel (°)' in a.csv; 'Winkel' in b.xlsx" in refusal.sentence


def test_a_draft_with_open_questions_is_not_written(draft_of, tmp_path):
    draft = draft_of(forces=TABLE)
    draft.understand()
    with pytest.raises(Exception, match="questions are still open"):
        draft.write(tmp_path / "x")
    assert not (tmp_path / "x").exists()


def test_a_seed_that_is_typed_is_read_and_refused_as_the_command_line_does():
    assert [read_seed(typed) for typed in ("", "  ", " 3 ")] == [None, None, 3]
    for typed in ("abc", "1.5", "-1", "9" * 30):
        with pytest.raises(UsageError) as refusal:
            read_seed(typed)
        assert str(refusal.value) == f"--seed = '{typed}' must be a whole number from 0 to 2147483647."
