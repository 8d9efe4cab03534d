"""A table that is typed or pasted becomes a file like any other."""

from bowdenfit.addons.app.sheet import paste_cells, to_csv

EMPTY = [["input_force_N", "output_force_N", "run"], *([""] * 3 for _ in range(2))]


def test_what_is_pasted_from_a_spreadsheet_fills_cells_and_makes_room():
    cells = paste_cells(EMPTY, "20\t15.2\t1\n40\t30.1\t1\n60\t45,6\t1\tnote\n", 1, 0)
    assert cells[0] == ["input_force_N", "output_force_N", "run", ""]
    assert cells[1:] == [["20", "15.2", "1", ""], ["40", "30.1", "1", ""], ["60", "45,6", "1", "note"]]
    assert EMPTY[1] == ["", "", ""]


def test_a_pasted_table_brings_its_headings():
    assert paste_cells(EMPTY, "F1 (N);F2 (N)\n1;2\n", 0, 0)[:2] == [["F1 (N)", "F2 (N)", "run"], ["1", "2", ""]]


def test_typed_cells_are_written_without_what_is_empty():
    cells = [["a (N)", "b (N)", "c"], ["1", " 2,5 ", ""], ["", "", ""], ["3", 'x"y', ""], ["", "", ""]]
    assert to_csv(cells) == 'a (N),b (N)\n1,"2,5"\n,\n3,"x""y"\n'
    assert to_csv(EMPTY) == ""
