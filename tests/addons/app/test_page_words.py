"""Pages say what can be done on a page: no options of a shell, no keys of a terminal."""

import re

import pytest

from bowdenfit.addons.app.draft import Draft
from bowdenfit.addons.app.page_words import page_html, page_words


@pytest.mark.parametrize(
    ("printed", "shown"),
    [
        ("Name it: --column wrap_angle='Bend (x):deg', or leave it.",
         "Name it: column 'Bend (x)' as wrap_angle in deg, or leave it."),
        ("say so: --column input_force='F 2' --column output_force='F 1'.",
         "say so: column 'F 2' as input_force and column 'F 1' as output_force."),
        ("by --channel input_force=ai0.", "by channel 'ai0' as input_force."),
        ("write --missing -9999 (in cable.toml missing = [-9999]), or", "write missing = [-9999] in cable.toml, or"),
        ("--seed = 'many' must be a whole number.", "seed = 'many' must be a whole number."),
        ("in deg; or run this in a terminal, which asks.", "in deg."),
        ("A bell does not follow; fit again with --set contact.0.wrap_angle.curve=logistic or --friction rate-dependent "
         "(bowdenfit compare says which).",
         'A bell does not follow; fit again with contact.0.wrap_angle.curve = "logistic" or friction_model = "rate-dependent" '
         "('Compare two fits' at the start says which)."),
        ("Next: `bowdenfit next` says more. [3 sentences more: bowdenfit summary --full]",
         "Next: 'Measure more, or stop' says more. [3 sentences more: on the page of the fit]"),
        ("Watching bench; Ctrl-C ends it.", "Watching bench."),
        ("x holds a finished fit already; add --force to replace it, or name another with --output.",
         "x holds a finished fit already; give this one another name."),
    ],
)  # fmt: skip
def test_a_sentence_is_said_without_options_and_keys(printed, shown):
    assert page_words(printed) == shown


def test_names_of_files_stay_whatever_they_are_called():
    for sentence in ("'--column' has no rows.", "'a --force b.csv' -- or '--seed=3' --- is odd"):
        assert page_words(sentence.replace(" --force", "--force")) == sentence.replace(" --force", "--force")


def test_only_the_text_of_html_is_changed():
    script = '<script type="a">x = "--seed"; </script>'
    html = f'<p style="--ink: 1">a &lt;b&gt; --seed <b>--force</b></p>{script}<br> bowdenfit next'
    changed = "a &lt;b&gt; seed <b>force</b></p>"
    assert page_html(html) == f"""<p style="--ink: 1">{changed}{script}<br> 'Measure more, or stop'"""


def test_a_refusal_of_columns_names_no_option(tmp_path):
    """Two columns could be the force, which the command line answers with options to paste."""
    draft = Draft(tmp_path)
    draft.new_file("bench.csv").write_text("Force 1 (N),Force 2 (N),Force 3 (N),Angle\n20,15,3,180\n40,30,3,180\n")
    understanding = draft.understand()
    sentences = [refusal.sentence for refusal in understanding.refusals] + [entry.hint for entry in understanding.entries]
    assert any(sentences)
    for sentence in sentences:
        assert not re.search(r"(?<!\w)--[a-z]|terminal|Ctrl-C", page_words(sentence)), page_words(sentence)
