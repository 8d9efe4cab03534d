"""Headings keep the case of their letters where they are printed: German nouns are not lowered."""

from bowdenfit.description import Route
from bowdenfit.words import capitalized


def test_a_route_keeps_the_case_of_its_words():
    assert Route(variable="freie Hülle", unit="mm", range=(0, 1)).label == "Freie Hülle (mm)"
    assert Route(variable="cable_length", unit="mm", range=(0, 1)).label == "Cable length (mm)"


def test_capitalizing_changes_the_first_letter_alone():
    assert [capitalized(text) for text in ("", "a", "wrap of the PTFE sheath")] == ["", "A", "Wrap of the PTFE sheath"]
