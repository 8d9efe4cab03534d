"""What is refused before sampling: coefficients that nothing tells apart, and draws that no memory holds."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import bowdenfit as bf
from bowdenfit.inference.least_squares import MaximumPosterior
from bowdenfit.models import build_model
from bowdenfit.run.refusing import refuse_large_sampling, refuse_undetermined

CONTACT = '[[contact]]\nname = "c{0}"\nfriction = "mu{0}"\nwrap_angle = {{ value = 1{0}, unit = "deg" }}\n'


def contacts(place, count, more=""):
    """A cable with contacts of which each has a coefficient of its own, and five readings."""
    text = "".join(map(CONTACT.format, range(count)))
    (place / "cable.toml").write_text(f'name = "x"\n{text}{more}[tables]\nforces = {{ file = "f.csv" }}\n')
    (place / "f.csv").write_text("input_force_N,output_force_N\n10,7\n20,14.1\n30,21\n40,28.2\n50,34.8\n")
    return place


def start_of(model, determined):
    """A maximum of the posterior of which the measurements determine so many coefficients."""
    size, indices = model.space.size, [model.space.index[f"mu{i}"] for i in range(determined)]
    shares = np.ones(size)
    shares[indices] = 0.01
    return MaximumPosterior(np.zeros(size), np.diag(shares))


def test_many_coefficients_that_nothing_tells_apart_are_refused_before_sampling(tmp_path):
    model = build_model(bf.read(contacts(tmp_path, 30)))
    refuse_undetermined(model, lambda: start_of(model, 10))
    with pytest.raises(bf.DescriptionError, match="of 30 that are free, 21 combinations would rest on their priors alone"):
        refuse_undetermined(model, lambda: start_of(model, 9))


def test_few_coefficients_and_stated_ones_are_not_looked_at(tmp_path):
    setting = "".join(f"[friction.mu{i}]\nmeasured = {{ value = 0.1, sd = 0.02 }}\n" for i in range(10))
    refuse_undetermined(build_model(bf.read(contacts(tmp_path, 30, setting))), lambda: pytest.fail("looked at"))


@pytest.mark.extended
def test_a_fit_of_many_more_contacts_than_readings_ends_with_a_sentence(tmp_path):
    with pytest.raises(bf.DescriptionError, match=r"of 60 that are free, 59 .* Give contacts of the same materials one"):
        bf.fit(contacts(tmp_path, 60), output=tmp_path / "fit")
    assert not (tmp_path / "fit").exists()


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        (["sampler.n_walkers=10000", "sampler.n_ensembles=100"], r"may take 28\.8 GB for 3 parameters, and at most 4\.3 GB"),
        (["sampler.method=nuts", "sampler.n_chains=1000", "sampler.max_steps=10000000"], "lower sampler.max_steps"),
        (["sampler.max_steps=10000000"], r"may take 12\.3 GB"),
    ],
)
def test_states_of_the_sampler_that_no_memory_holds_are_refused(tmp_path, settings, says):
    model = build_model(bf.read(contacts(tmp_path, 1), settings=settings))
    with pytest.raises(bf.UsageError, match=says):
        refuse_large_sampling(model)


def test_draws_of_more_readings_than_memory_holds_are_refused(tmp_path):
    model = build_model(bf.read(contacts(tmp_path, 1)))
    refuse_large_sampling(model)
    many = replace(model, terms=(SimpleNamespace(labels=range(40_000)),))
    with pytest.raises(bf.UsageError, match=r"10,240 draws of 40,000 readings take 9\.8 GB, and at most 8\.6 GB are kept"):
        refuse_large_sampling(many)
