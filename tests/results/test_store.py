"""The results folder: whole, never overwritten by accident, and read back bit for bit."""

import dataclasses
import json
import shutil

import numpy as np
import pytest
from conftest import ROOT
from forged_fits import edit_sealed

import bowdenfit as bf
from bowdenfit.inference.checkpoint import checkpoint_header, read_fingerprint
from bowdenfit.outputs import replace_atomically
from bowdenfit.results.serialization import coarsen_predictions, round_draws, to_single, write_arrays

DATA_SETS = ROOT / "datasets"
QUICK = (
    "sampler.n_ensembles=2",
    "sampler.n_walkers=64",
    "sampler.max_steps=400",
    "sampler.target_ess=100",
    "sampler.target_r_hat=1.2",
)


@pytest.fixture(scope="module")
def saved(on_body, tmp_path_factory):
    """A quick fit of the on-body data with its folder."""
    folder = tmp_path_factory.mktemp("results") / "fit"
    return bf.fit(on_body, output=folder, seed=3, settings=QUICK, figures=False), folder


@pytest.fixture(scope="module")
def unfinished(on_body, tmp_path_factory):
    """Folder of the same fit that was interrupted."""
    folder = tmp_path_factory.mktemp("unfinished") / "fit"
    interrupted(on_body, folder, 200)
    return folder


def assert_same(a, b, location=""):
    """Equal to the last bit, all the way down."""
    assert type(a) is type(b), location
    if dataclasses.is_dataclass(a):
        for part in dataclasses.fields(a):
            assert_same(getattr(a, part.name), getattr(b, part.name), f"{location}.{part.name}")
    elif isinstance(a, dict):
        assert list(a) == list(b), location
        for key in a:
            assert_same(a[key], b[key], f"{location}[{key}]")
    elif isinstance(a, np.ndarray):
        assert a.dtype == b.dtype, location
        np.testing.assert_array_equal(a, b, err_msg=location, strict=True)
    elif isinstance(a, float) and np.isnan(a):
        assert np.isnan(b), location
    elif isinstance(a, tuple):
        assert len(a) == len(b), location
        for i, (x, y) in enumerate(zip(a, b, strict=True)):
            assert_same(x, y, f"{location}[{i}]")
    else:
        assert a == b, location


def test_a_fit_is_read_back_bit_for_bit(saved):
    fit, folder = saved
    again = bf.Fit.load(folder)
    assert_same(fit.posterior, again.posterior, "posterior")
    assert_same(fit.least_squares, again.least_squares, "least_squares")
    assert_same(fit.dataset.measurements, again.dataset.measurements, "measurements")
    assert fit.dataset.description == again.dataset.description
    assert fit.dataset.sha256 == again.dataset.sha256
    assert (fit.converged, fit.reasons) == (again.converged, again.reasons)
    assert (fit.provenance.seed, fit.provenance.versions) == (again.provenance.seed, again.provenance.versions)


def test_a_loaded_fit_gives_the_same_answers(saved):
    fit, folder = saved
    again = bf.load(folder)
    np.testing.assert_equal(*map(dataclasses.asdict, (fit.optimal_length(), again.optimal_length())))  # NaN without a window
    assert fit.efficiency([455.0, 470.0]) == again.efficiency([455.0, 470.0])
    assert json.loads((folder / "summary.json").read_text()) == again.summary()


def test_a_record_answers_each_question_once(saved):
    fit, _ = saved
    assert fit.verdict() is fit.verdict()
    assert fit.known is fit.known
    assert fit.checks is fit.checks


def test_the_same_seed_gives_the_same_draws(saved, on_body):
    fit, _ = saved
    again = bf.fit(on_body, seed=3, settings=QUICK)
    np.testing.assert_array_equal(fit.posterior.z, again.posterior.z)


def test_the_posterior_file_opens_in_arviz(saved):
    import xarray

    fit, folder = saved
    with xarray.open_datatree(folder / "posterior.nc", engine="h5netcdf") as tree:
        assert {"posterior", "log_likelihood", "posterior_predictive", "prior", "observed_data", "sample_stats"} <= set(
            tree.children
        )
        assert tree["posterior"]["optimal_length"].attrs["units"] == "mm"
        assert tree["posterior"]["mu1"].dims == ("chain", "draw")
        assert tree["posterior"].sizes["chain"] == fit.posterior.n_ensembles
        assert "free_sheath_angle_A" in tree["derived"] and "free_sheath_angle_A" not in tree["posterior"]
        assert set(tree["log_likelihood"].data_vars) == set(tree["observed_data"].data_vars)
        assert json.loads(tree.attrs["provenance"])["seed"] == fit.provenance.seed


def test_a_fit_in_memory_gives_arviz_the_same_as_its_file(saved):
    import xarray

    fit, folder = saved
    with xarray.open_datatree(folder / "posterior.nc", engine="h5netcdf") as tree:
        xarray.testing.assert_identical(fit.idata, tree.load())


def test_correlations_are_those_of_the_draws(saved):
    fit, _ = saved
    table = fit.correlation()
    names = [p.name for p in fit.model.space.free]
    assert list(table.index) == list(table.columns) == names
    draws = [fit.posterior.values[name].ravel() for name in ("mu1", "mu3")]
    assert table.loc["mu1", "mu3"] == pytest.approx(np.corrcoef(*draws)[0, 1])
    assert fit.to_dataframe().equals(fit.to_frame())


def test_the_log_posterior_in_the_file_is_that_of_the_draws(saved):
    import jax
    import xarray

    from bowdenfit.inference.log_density import LogDensity

    fit, folder = saved
    density = LogDensity(fit.model)
    expected = jax.jit(jax.vmap(density.log_density, in_axes=(0, None)))(fit.posterior.flat_z, density.data)
    with xarray.open_datatree(folder / "posterior.nc", engine="h5netcdf") as tree:
        of_file = tree["sample_stats"]["lp"].values.ravel()
    np.testing.assert_allclose(of_file, expected, rtol=0, atol=2e-3 * np.std(expected))  # of rounded parts


def test_a_finished_fit_is_not_overwritten(saved, on_body):
    _, folder = saved
    initial = (folder / "fit.json").read_bytes()
    with pytest.raises(bf.StoreError, match="--force"):
        bf.fit(on_body, output=folder, settings=QUICK)
    assert (folder / "fit.json").read_bytes() == initial


def test_force_replaces_a_fit_and_nothing_else(saved, on_body, tmp_path):
    _, folder = saved
    copy = shutil.copytree(folder, tmp_path / "copy")
    (copy / "chain.checkpoint").write_bytes(b"of a fit that has not converged")
    (copy / "notes.txt").write_text("mine")
    fit = bf.fit(on_body, output=copy, mcmc=False, seed=9, figures=False, force=True, settings=QUICK)
    assert bf.load(copy).provenance.seed == fit.provenance.seed == 9
    assert not (copy / "posterior.nc").exists()
    assert not (copy / "chain.checkpoint").exists()
    assert (copy / "notes.txt").read_text() == "mine"


def test_a_folder_of_something_else_is_left_alone(on_body, tmp_path):
    (tmp_path / "thesis.tex").write_text("...")
    with pytest.raises(bf.StoreError, match="not a results folder"):
        bf.fit(on_body, output=tmp_path, mcmc=False)
    assert [p.name for p in tmp_path.iterdir()] == ["thesis.tex"]


class Stop(Exception):
    """Stands for the user's interrupt."""


def interrupted(on_body, folder, offset, **options):
    """A fit that is interrupted once it has taken `offset` steps."""

    def stop(progress):
        if progress.steps >= offset:
            raise Stop

    with pytest.raises(Stop):
        bf.fit(on_body, output=folder, seed=3, settings=QUICK, figures=False, progress=stop, **options)


def test_an_interrupted_fit_leaves_its_checkpoint_and_nothing_half_written(unfinished, on_body):
    assert [p.name for p in unfinished.iterdir()] == ["chain.checkpoint"]
    with pytest.raises(bf.StoreError, match="--resume"):
        bf.fit(on_body, output=unfinished, settings=QUICK)
    with pytest.raises(bf.StoreError, match="--resume"):
        bf.load(unfinished)


def test_a_resumed_fit_equals_one_that_was_never_interrupted(saved, unfinished, on_body, tmp_path):
    fit, _ = saved
    folder = shutil.copytree(unfinished, tmp_path / "fit")
    resumed = bf.fit(on_body, output=folder, settings=QUICK, figures=False, resume=True)
    np.testing.assert_array_equal(resumed.posterior.z, fit.posterior.z)
    assert resumed.provenance.seed == 3


@pytest.mark.extended
def test_a_checkpoint_from_before_a_setting_existed_is_resumed(saved, unfinished, on_body, tmp_path):
    """Settings that have come since stand at their defaults."""
    fit, _ = saved
    copy = shutil.copytree(unfinished, tmp_path / "copy")
    page, path = read_fingerprint(copy / "chain.checkpoint"), copy / "chain.checkpoint"
    now = checkpoint_header(page)
    for key in ("method", "n_chains", "target_acceptance"):
        del page["description"]["sampler"][key]
    path.write_bytes(checkpoint_header(page) + path.read_bytes().removeprefix(now))
    again = bf.fit(on_body, output=copy, settings=QUICK, figures=False, resume=True)
    np.testing.assert_array_equal(again.posterior.z, fit.posterior.z)


@pytest.mark.extended
def test_resume_tops_up_a_fit_that_has_not_converged(on_body, tmp_path):
    settings = (*QUICK, "sampler.target_r_hat=1.0000001")
    fit = bf.fit(on_body, output=tmp_path / "fit", figures=False, seed=3, settings=settings)
    longer = (*settings, "sampler.max_steps=600")
    more = bf.fit(on_body, output=tmp_path / "fit", figures=False, resume=True, settings=longer)
    assert (more.posterior.steps, fit.posterior.steps) == (600, 400)
    assert not more.converged


def test_of_a_converged_fit_no_checkpoint_is_left_to_resume(tmp_path):
    yarn, settings = DATA_SETS / "yarn-on-cylinder", (*QUICK, "sampler.max_steps=2000", "sampler.target_r_hat=1.5")
    assert bf.fit(yarn, output=tmp_path / "fit", figures=False, seed=3, settings=settings).converged
    assert not (tmp_path / "fit" / "chain.checkpoint").exists()
    with pytest.raises(bf.StoreError, match="nothing is left to resume"):
        bf.fit(yarn, output=tmp_path / "fit", resume=True, settings=settings)


def test_draws_are_written_in_single_precision(saved):
    import h5py

    with h5py.File(saved[1] / "posterior.nc") as file:
        assert file["posterior"]["mu1"].dtype == file["log_likelihood"]["wrap_angle"].dtype == np.float32


def test_rounding_hides_nothing_of_how_draws_scatter():
    """A coefficient of 1 known to 1e-7 stays as it is, beside one that is known to 1 %, and one that may be infinite."""
    rng = np.random.default_rng(1)
    draws = 1 + rng.standard_normal((2, 500, 3)) * [1e-7, 1e-2, 1e-2]
    draws[0, 0, 2] = np.inf
    rounded = round_draws(draws)
    np.testing.assert_array_equal(rounded[..., [0, 2]], draws[..., [0, 2]])
    np.testing.assert_array_equal(rounded[..., 1], draws[..., 1].astype(np.float32))
    assert np.ptp(to_single(draws)[..., 0]) > 0 and np.isclose(np.std(rounded[..., 0]), 1e-7, rtol=0.1)


def test_rounded_predictions_keep_how_they_scatter():
    """Each moves by less than a thousandth of a standard deviation, whatever lies far out; what never varies stays."""
    rng = np.random.default_rng(1)
    values = np.stack([rng.standard_normal((20, 50)), np.full((20, 50), 1 / 3), rng.standard_normal((20, 50))], axis=-1)
    values[0, :2, 2] = -1e6, -np.inf
    rounded = coarsen_predictions(values)
    np.testing.assert_array_equal(rounded[..., 1], values[..., 1])
    assert np.isneginf(rounded[0, 1, 2])
    moved = np.abs(rounded[np.isfinite(values)] - values[np.isfinite(values)]).max()
    assert 1e-4 < moved < 1.1e-3


def test_a_results_folder_takes_few_bytes_a_number(saved, tmp_path):
    """The on-body data set's, of 10240 draws, takes 4.7 MB, of which figures and report are 1.1."""
    draws = saved[0].posterior
    groups = (draws.values, draws.optimum, draws.log_likelihood, draws.expected, draws.replicated, draws.prior)
    numbers = draws.z.size + sum(values.size for group in groups for values in group.values())
    assert (saved[1] / "posterior.nc").stat().st_size < 3.1 * numbers
    write_arrays(tmp_path / "figures.npz", {"draws": draws.values["mu1"], "exact": np.full(1000, 1 / 3)})
    assert (tmp_path / "figures.npz").stat().st_size < 4 * draws.values["mu1"].size + 8 * 1000 + 2000


@pytest.mark.parametrize("change", ["friction.mu1.fixed=0.1", "tables.angles.undetected=dropped"])
def test_resume_refuses_a_changed_input(unfinished, on_body, change):
    with pytest.raises(bf.StoreError, match="changed"):
        bf.fit(on_body, output=unfinished, resume=True, settings=(*QUICK, change))


def test_resume_refuses_another_seed(unfinished, on_body):
    with pytest.raises(bf.StoreError, match="seed changed"):
        bf.fit(on_body, output=unfinished, resume=True, seed=4, settings=QUICK)


def test_resume_needs_a_checkpoint(on_body, tmp_path):
    with pytest.raises(bf.StoreError, match="no checkpoint"):
        bf.fit(on_body, output=tmp_path / "nothing", resume=True)


def test_a_damaged_checkpoint_is_a_sentence(on_body, tmp_path):
    (tmp_path / "chain.checkpoint").write_bytes(b"something else")
    with pytest.raises(bf.StoreError, match="damaged"):
        bf.fit(on_body, output=tmp_path, resume=True)


@pytest.mark.parametrize(
    ("damage", "says"),
    [
        (lambda f: (f / "fit.json").write_text("{"), "damaged"),
        (lambda f: (f / "fit.json").write_text("{}"), "damaged"),
        (lambda f: (f / "posterior.nc").unlink(), "missing"),
        (lambda f: (f / "posterior.nc").write_bytes(b"..."), "damaged"),
        (lambda f: (f / "fit.json").write_text('{"schema": 99}'), "newer bowdenfit"),
        (lambda f: (f / "fit.json").write_text('{"schema": 3}'), "older bowdenfit .* fit the data set again"),
    ],
)
def test_a_damaged_folder_is_a_sentence(saved, tmp_path, damage, says):
    copy = shutil.copytree(saved[1], tmp_path / "copy")
    damage(copy)
    with pytest.raises(bf.StoreError, match=says):
        bf.load(copy)


def test_a_missing_folder_is_a_sentence(tmp_path):
    with pytest.raises(bf.StoreError, match="does not exist"):
        bf.load(tmp_path / "nowhere")


def test_a_write_that_fails_leaves_the_old_file(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("old")
    with pytest.raises(Stop), replace_atomically(path) as temporary:
        temporary.write_text("new, but")
        raise Stop
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_the_checkpoint_carries_what_it_was_started_for(saved, unfinished):
    page = read_fingerprint(unfinished / "chain.checkpoint")
    assert page["seed"] == 3
    assert page["sha256"] == saved[0].dataset.sha256


def test_a_fit_from_before_a_kind_of_table_existed_is_read(saved, tmp_path):
    fit, folder = saved
    copy = shutil.copytree(folder, tmp_path / "copy")

    def of_before(page):
        absent = next(name for name, table in page["measurements"].items() if table is None)
        del page["measurements"][absent]

    edit_sealed(copy / "fit.json", of_before)
    np.testing.assert_array_equal(bf.load(copy).posterior.z, fit.posterior.z)
