"""posterior.nc: draws as an ArviZ DataTree, from plain data and back; loads no model."""

import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import TypeAlias

import numpy as np

from bowdenfit.results.folder import replace_when_whole

Groups: TypeAlias = dict[str, dict[str, np.ndarray]]
Coordinates: TypeAlias = Mapping[str, tuple[str, ...]]
EXPECTED = "expected_"


def write_groups(
    path: Path,
    groups: Groups,
    labels: Coordinates,
    attributes: Mapping[str, str],
    variable_attributes: Mapping[str, Mapping[str, str]],
) -> None:
    """Write posterior.nc whole.

    Args:
        path: The file.
        groups: Arrays by group and name; draws have walkers first, then the draws of each, then readings.
        labels: Labels of the readings, by table.
        attributes: Attributes of the file.
        variable_attributes: Unit, symbol and meaning by variable.
    """
    import arviz_base

    dimensions = {f"{prefix}{name}": [f"{name}_reading"] for name in labels for prefix in ("", EXPECTED)}
    with warnings.catch_warnings():
        # Each walker is a chain, because flattening walkers into few chains would inflate effective sample sizes.
        warnings.filterwarnings("ignore", "Found chain dimension to be longer", UserWarning)
        tree = arviz_base.from_dict(
            dict(groups),
            coords={f"{name}_reading": list(of_table) for name, of_table in labels.items()},
            dims=dimensions,
            attrs={"/": dict(attributes)},
        )
    for group in ("posterior", "prior"):
        for name in map(str, tree[group].data_vars):
            tree[group][name].attrs |= dict(variable_attributes.get(name, {}))
    with replace_when_whole(path) as temporary:
        tree.to_netcdf(temporary, engine="h5netcdf")


def read_groups(path: Path) -> Groups:
    """Arrays of posterior.nc by group and name."""
    import xarray

    with xarray.open_datatree(path, engine="h5netcdf") as tree:
        return {
            group: {name: np.asarray(tree[group][name].values) for name in map(str, tree[group].data_vars)}
            for group in tree.children
        }
