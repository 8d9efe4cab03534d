"""The command that a page shows asks what the page asks, and survives a shell."""

import shlex
from pathlib import Path

import pytest

from bowdenfit.addons.app.description_edit import exclude_part, preview_exclusion
from bowdenfit.addons.app.equivalent_command import write_command
from bowdenfit.addons.app.fit_job import FitRequest
from bowdenfit.questions.compare.verb import VERB as COMPARE
from bowdenfit.questions.export.verb import VERB as EXPORT
from bowdenfit.questions.predict.verb import VERB as PREDICT
from bowdenfit.run.verb import VERB as FIT

HERE = Path("/bench")


@pytest.mark.parametrize(
    ("verb", "request_", "command"),
    [
        (FIT, vars(FitRequest(HERE / "my cable", HERE / "fits" / "a")), "bowdenfit fit 'my cable' --output fits/a"),
        (FIT, vars(FitRequest(HERE / "-x", HERE / "fits" / "a", 0, mcmc=False, resume=True)),
         "bowdenfit fit ./-x --output fits/a --seed 0 --no-mcmc --resume"),
        (FIT, vars(FitRequest(HERE, HERE / "fits" / "a")), "bowdenfit fit . --output fits/a"),
        (PREDICT, {"fit": HERE / "fits" / "a", "output_force": "5N", "stroke": "return", "lengths": [470.5]},
         "bowdenfit predict fits/a 470.5 --output-force 5N --stroke return"),
        (PREDICT, {"fit": HERE / "fits" / "a", "input_force": "5N", "wrap_angles": {"a b": "90deg", "c": "1deg"}},
         "bowdenfit predict fits/a --input-force 5N --wrap-angle 'a b=90deg' --wrap-angle c=1deg"),
        (COMPARE, {"fits": {"a": HERE / "fits" / "a", "b": HERE / "fits" / "$b"}}, "bowdenfit compare fits/a 'fits/$b'"),
        (EXPORT, {"fit": HERE / "fits" / "a", "to": "csv"}, "bowdenfit export fits/a --to csv"),
    ],
)  # fmt: skip
def test_a_request_is_written_as_the_command_line_takes_it(verb, request_, command):
    assert write_command(verb, request_, HERE) == command
    assert shlex.split(command)[1] == verb.command_name


def test_the_lines_that_leave_a_row_out_are_those_that_are_saved(tmp_path):
    from half_turn_bench import describe_half_turn

    (tmp_path / "cable.toml").write_text(describe_half_turn(name="bench"))
    (tmp_path / "forces.csv").write_text("input_force_N,output_force_N,run\n20,15,1\n40,30,2\n60,45,3\n")
    exclude_part(tmp_path, "forces", "forces.csv", 2, "it  slipped")
    lines = preview_exclusion(tmp_path, "forces", "forces.csv", 3, 'the "rope" jumped')
    exclude_part(tmp_path, "forces", "forces.csv", 3, 'the "rope" jumped')
    assert lines.splitlines()[0] == "[tables.forces]"
    assert lines.splitlines()[1] in (tmp_path / "cable.toml").read_text()
    assert "it slipped" in lines
