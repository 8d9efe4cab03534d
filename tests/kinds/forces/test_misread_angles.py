"""Angles that are off by turns: named with the angle that fits, and never on healthy benches, whatever their mountings do."""

import numpy as np
import pytest

import bowdenfit as bf
from bowdenfit.kinds.descriptions import parse_description
from bowdenfit.kinds.forces.misread_angles import describe_misread_angles
from bowdenfit.kinds.forces.table import ForceTable
from bowdenfit.kinds.rows import OwnAngles, RowOrigin

DESCRIPTION = parse_description(
    {
        "name": "sheath",
        "contact": [{"name": "sheath", "friction": "mu", "wrap_angle": {"column": "wrap_angle"}}],
        "tables": {"forces": {"file": "forces.csv"}},
    }
)


def bench_table(rng, true_angles, noted_angles, mu=None, tau=None, noise=None, run_of_angle=True):
    """Forces of a sheath without the package's model: one mounting per angle, or per true angle, loads of 1 N to 10 kN."""
    mu = np.exp(rng.uniform(np.log(0.03), np.log(0.4))) if mu is None else mu
    tau = np.exp(rng.uniform(np.log(0.002), np.log(0.3))) if tau is None else tau
    noise = rng.uniform(0.001, 0.05) if noise is None else noise
    loads = 10 ** rng.uniform(0, 4) * np.linspace(0.2, 1, int(rng.integers(2, 7)))
    repeats, drag = int(rng.integers(1, 4)), rng.choice([0.0, 0.05]) * loads.max()
    rows = [
        (noted, noted if run_of_angle else number, load, load - drag * 0.3, exponent)
        for number, (true, noted) in enumerate(zip(true_angles, noted_angles, strict=True))
        for exponent in [max(mu * np.deg2rad(true) + rng.normal(0, tau), 0.01)]
        for load in np.repeat(loads, repeats)
    ]
    angle, run, force, pulled, exponent = np.array(rows).T
    names, run = np.unique(run, return_inverse=True)
    scatter = np.exp(noise * rng.standard_normal((2, len(rows))))
    n = len(rows)
    angles = OwnAngles(("wrap_angle",), np.deg2rad(angle)[:, None], np.full((n, 1), np.nan))
    return ForceTable(
        np.full(n, np.nan), force * scatter[0], pulled * np.exp(-exponent) * scatter[1], run, tuple(map(str, names)),
        np.ones(n, dtype=int), angles, RowOrigin(("forces.csv",), np.zeros(n, dtype=int), np.arange(2, n + 2)),
        np.full(n, np.nan),
    )  # fmt: skip


def random_angles(rng):
    """Angles that a bench has, each once or several times."""
    return rng.choice([20.0, 45.0, 60.0, 90.0, 120.0, 180.0, 270.0, 360.0, 450.0], int(rng.integers(1, 12)))


@pytest.mark.extended
def test_none_of_4000_healthy_benches_is_named():
    rng = np.random.default_rng(20)
    named = 0
    for number in range(4000):
        angles = np.unique(random_angles(rng)) if number % 2 else random_angles(rng)
        table = bench_table(rng, angles, angles, run_of_angle=bool(number % 2))
        named += bool(describe_misread_angles(table, DESCRIPTION))
    assert named <= 4, "1 in 1000"


def describe_benches(true, noted, n=60):
    """What is said of benches with such angles, whose mountings are alike within 0.5 % and cells within 1 %."""
    rng = np.random.default_rng(21)
    tables = [bench_table(rng, true, noted, rng.uniform(0.08, 0.25), 0.005, 0.01) for _ in range(n)]
    return [describe_misread_angles(table, DESCRIPTION) for table in tables]


@pytest.mark.parametrize(
    ("true", "noted", "sentence", "share"),
    [
        ((90, 180, 270, 450), (90, 180, 270, 90), "90 deg in rows", 0.8),
        ((90, 180, 270, 450, 540), (90, 180, 270, 90, 180), "where 540 deg fits", 0.8),
        ((90, 180, 270, 45, 225), (90, 180, 270, 45, 45), "where 225 deg fits", 0.5),
    ],
)
def test_an_angle_that_lacks_turns_is_named_with_the_one_that_fits(true, noted, sentence, share):
    described = describe_benches(true, noted)
    assert np.mean([bool(text) for text in described]) >= 0.8
    assert np.mean([sentence in text for text in described]) >= share


def test_without_an_explaining_turn_other_causes_are_named():
    described = describe_benches((90, 180, 270, 230), (90, 180, 270, 90))
    assert np.mean(["greased in between" in text for text in described]) >= 0.5  # with more noise or drag nothing is named


def test_a_run_of_its_own_for_each_angle_is_left_to_other_checks():
    table = bench_table(np.random.default_rng(23), (90, 450), (90, 90), 0.1, 0.003, 0.005, run_of_angle=False)
    assert describe_misread_angles(table, DESCRIPTION) == ""


def test_such_a_table_is_not_trusted_and_check_warns_of_it(tmp_path):
    rows = [
        f"{noted},{load},{load * np.exp(-0.12 * np.deg2rad(true)) + 0.01 * number:.2f}"
        for true, noted in ((90, 90), (180, 180), (270, 270), (450, 90))
        for number, load in enumerate((10, 20, 40, 60))
    ]
    file = tmp_path / "forces.csv"
    file.write_text("wrap_angle_deg,input_force_N,output_force_N\n" + "\n".join(rows) + "\n")
    verdict = bf.fit(file, mcmc=False).verdict()
    assert "where 450 deg fits" in " ".join(verdict.troubles["contradictory"])
    assert "where 450 deg fits" in " ".join(str(bf.check(file)).split())


def test_radians_in_a_column_of_degrees_are_named():
    rng, true = np.random.default_rng(3), [45.0, 45.0, 90.0, 90.0, 180.0, 270.0]
    for noted in ([*true[:4], np.pi, 1.5 * np.pi], [*np.deg2rad(true[:5]), 270.0]):
        table = bench_table(rng, true, noted, mu=0.12, tau=0.02, noise=0.01, run_of_angle=False)
        words = describe_misread_angles(table, DESCRIPTION)
        assert "seem to be radians" in words and "3.142 in rows" in words and "which would be 180 deg" in words
        assert ("45" in words.split(";")[0]) == (noted[0] < 1)
