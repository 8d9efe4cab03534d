"""Groups of readings, such as of a new and an old rope, have friction coefficients of their own where that is asked for."""

import jax.numpy as jnp
import numpy as np
import pytest
from hand_bench import BENDS, pull

from bowdenfit.dataset import load_dataset
from bowdenfit.errors import DescriptionError
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.kinds.forces.table import ForceTable
from bowdenfit.models import build_model

TRUE = {"new rope": 0.1, "old": 0.2}
BY_GROUP = 'friction_model = "by-group"\n'


def _folder(path, groups=tuple(TRUE), description=BENDS, top="", extra="", heading="group", run=None):
    """Two mountings of each group at one bend; the same labels in each."""
    path.mkdir(parents=True, exist_ok=True)
    (path / "cable.toml").write_text(top + description.replace('"forces.csv"', f'"forces.csv"{extra}'))
    lines = [f"run,{heading},wrap_angle_deg,stroke,input_force_N,output_force_N"]
    for group, mu in zip(groups, TRUE.values(), strict=True):
        rows = pull(np.random.default_rng(1), [180.0] * 2, [mu * np.pi] * 2, (20, 40, 60), noise=(0.1, 0.1), scatter=0.01)
        lines += [
            f"{run or label},{group},180,{stroke:+d},{force_in:.4f},{force_out:.4f}"
            for label, stroke, force_in, force_out in zip(rows.label, rows.stroke, rows.force_in, rows.force_out, strict=True)
        ]
    (path / "forces.csv").write_text("\n".join(lines) + "\n")
    return path


def _density(folder, *settings):
    return LogDensity(build_model(load_dataset(folder, settings)))


def _log_likelihood(model, z):
    (term,) = model.terms
    return float(jnp.sum(term.log_likelihood(model.space.constrain(jnp.asarray(z)), term.data)))


def test_equal_coefficients_of_all_groups_are_the_shared_one(tmp_path):
    folder = _folder(tmp_path)
    shared, own_density = _density(folder), _density(folder, 'friction_model="by group+drag"', "prior.drag.fixed=0.0")
    names = [p.name for p in own_density.model.space.free]
    assert names[:2] == ["mu[new rope]", "mu[old]"]
    z = 0.5 * np.random.default_rng(0).standard_normal(shared.model.space.size)
    first, other = (
        _log_likelihood(density.model, point) for density, point in ((shared, z), (own_density, np.append(z[0], z)))
    )
    assert first == pytest.approx(other, abs=1e-9)
    assert abs(_log_likelihood(own_density.model, np.append(z[0] + 0.5, z)) - first) > 1


def test_a_group_has_a_name_that_fits_into_a_table(tmp_path):
    with pytest.raises(DescriptionError, match="a group has a name of 81 characters"):
        load_dataset(_folder(tmp_path, ("n" * 81, "old"), top=BY_GROUP))


def test_a_group_is_read_with_its_own_coefficient(tmp_path):
    model = _density(_folder(tmp_path, top=BY_GROUP)).model
    values = {p.name: jnp.asarray(0.01) for p in model.space.parameters} | {
        "mu[new rope]": jnp.asarray(0.1), "mu[old]": jnp.asarray(0.2)
    }  # fmt: skip
    (term,) = model.terms
    np.testing.assert_allclose(term.expected(values, term.data), np.exp(-np.pi * np.array([0.1, 0.1, 0.2, 0.2])), rtol=1e-3)
    np.testing.assert_allclose(model.cable.efficiency_at(values, jnp.zeros(1)), np.exp(-np.pi * 0.1))


def test_predictions_are_for_the_group_that_is_named(tmp_path):
    model = _density(_folder(tmp_path, top=BY_GROUP), 'group="old"').model
    values = {"mu[new rope]": jnp.asarray(0.1), "mu[old]": jnp.asarray(0.2)}
    np.testing.assert_allclose(model.cable.efficiency_at(values, jnp.zeros(1)), np.exp(-np.pi * 0.2))
    with pytest.raises(DescriptionError, match="did you mean 'old'"):
        _density(tmp_path, 'group="olt"')


def test_a_contact_may_be_shared_by_all_groups(tmp_path):
    pulley = '[[contact]]\nname = "pulley"\nfriction = "mu2"\nby_group = false\nwrap_angle = { value = 90, unit = "deg" }\n'
    folder = _folder(tmp_path, top=BY_GROUP, description=BENDS.replace("[tables]", f"{pulley}[tables]"))
    assert build_model(load_dataset(folder)).cable.coefficients == ("mu[new rope]", "mu[old]", "mu2")
    both = build_model(load_dataset(folder, ["contact.1.by_group=true"])).cable.coefficients
    assert both == ("mu[new rope]", "mu[old]", "mu2[new rope]", "mu2[old]")


def test_what_is_said_of_a_coefficient_holds_for_each_group_unless_said_of_one(tmp_path):
    text = '[friction."mu[old]"]\nfixed = 0.3\n[friction.mu]\nmeasured = { value = 0.1, sd = 0.01 }\n[tables]'
    folder = _folder(tmp_path, top=BY_GROUP, description=BENDS.replace("[tables]", text))
    new, old = build_model(load_dataset(folder)).space.parameters[:2]
    assert new.prior_text == "measured 0.1 ± 0.01" and old.fixed == 0.3


def test_a_label_in_another_group_is_another_mounting_unless_it_stayed_mounted(tmp_path, accept):
    table = load_dataset(_folder(tmp_path / "anew")).measurements.table(ForceTable)
    assert table.run_names == ("1 (new rope)", "2 (new rope)", "1 (old)", "2 (old)")
    output = " ".join(accept("check", tmp_path / "anew").split())
    assert "in another group" in output and "across groups" in output and "--friction by-group" in output
    stayed = _folder(tmp_path / "stayed", extra=', run = "across groups"')
    assert load_dataset(stayed).measurements.table(ForceTable).run_names == ("1", "2")


def test_check_says_of_which_groups_coefficients_are(tmp_path, accept):
    output = accept("check", _folder(tmp_path), "--friction", "by-group")
    assert "mu: free, default prior; one for each of the groups new rope and old" in output


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"groups": ("1", "2")}, ['called by numbers', "temperature"]),
        ({"groups": ("new", "")}, ["row 14", "blank", "'new'"]),
        ({"groups": ("new", "new")}, ["one group (new)"]),
        ({"heading": "rope"}, ["no column group", 'group = { name = "rope" }']),
        ({"description": BENDS.replace('friction = "mu"', 'friction = "by group"')}, ["name of the coefficient", "--friction"]),
    ],
)  # fmt: skip
def test_a_column_that_names_no_groups_is_refused(tmp_path, refuse, changes, message):
    sentence = refuse("check", _folder(tmp_path, top=BY_GROUP, **changes))
    assert all(words in sentence for words in message), sentence


def test_tables_without_groups_are_refused_beside_those_with(tmp_path, refuse):
    more = 'efficiencies = { file = "efficiencies.csv" }\n'
    folder = _folder(tmp_path, top=BY_GROUP, description=BENDS + more)
    (folder / "efficiencies.csv").write_text("wrap_angle_deg,efficiency\n180,0.7\n")
    assert "efficiencies say nothing about groups" in refuse("check", folder)


def test_groups_called_by_numbers_are_read_where_that_is_said(tmp_path, accept):
    folder = _folder(tmp_path, groups=("1", "2"), extra=', groups = "called by numbers"', top=BY_GROUP)
    assert build_model(load_dataset(folder)).cable.coefficients == ("mu[1]", "mu[2]")
    assert "It is not used" in accept("check", _folder(tmp_path / "not", groups=("1", "2")))


# Rows of one mounting each -------------------------------------------------------------------------------------------


def test_every_row_can_be_a_run_of_its_own(tmp_path, accept):
    folder = _folder(tmp_path, extra=', run = "each row"')
    table = load_dataset(folder).measurements.table(ForceTable)
    assert len(table.run_names) == len(table.run) == 24 and table.run_names[0] == "row 2"
    assert "mounting of its own" in " ".join(accept("check", folder).split())
    answer = accept("check", _folder(tmp_path / "asked"), "--set", "tables.forces.run=each row")
    assert "24 runs" in answer


def test_rows_of_one_mounting_each_are_weighed_together(tmp_path):
    """A reading weighed by itself weighs more where noise makes its output larger."""
    (term,) = build_model(load_dataset(_folder(tmp_path, extra=', run = "each row"'))).terms
    rows, group = term.rows, np.repeat([0, 1], 12)
    np.testing.assert_allclose(rows.log_ratio, rows.stroke * np.log(rows.input_force / rows.output_force))
    by_itself = 1 / (rows.input_force**-2 + rows.output_force**-2)
    for mask in [(group == g) & (rows.stroke > 0) for g in (0, 1)]:
        less = np.log(by_itself[mask] / rows.weight(1.0)[mask])
        assert np.corrcoef(less, rows.log_ratio[mask])[0, 1] < -0.9
