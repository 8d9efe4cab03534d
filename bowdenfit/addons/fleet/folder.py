"""A fleet as files: the table of its inspections, and fleet.nc, the draws of all cables in one ArviZ tree."""

import io
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5netcdf
import h5py
import numpy as np

from bowdenfit.errors import StoreError
from bowdenfit.inputs import refuse_special
from bowdenfit.outputs import replace_atomically
from bowdenfit.results.answer_cache import file_checksum
from bowdenfit.results.folder import read_page
from bowdenfit.results.netcdf import own_member, read_own_hdf5
from bowdenfit.types import Vector

FLEET_TABLE, FLEET_DESCRIPTION = "fleet.csv", "fleet.toml"  # of the measurements: its inspections, and what all have in common
COLUMNS = ("cable", "cycles", "temperature_degC", "lubricated", "file")
FLEET_DRAWS, FLEET_PAGE = "fleet.nc", "fleet.json"
CHECKSUM = "draws_crc32"  # in fleet.json, of fleet.nc
_METADATA = {"cycles": "1", "temperature": "degC", "lubricated": "1"}
_POSTERIOR = "posterior"


@dataclass(frozen=True)
class FleetDraws:
    """Draws of all inspections that were fitted, in the order of cables and cycles.

    Args:
        label: Label of each inspection; no two are alike.
        cable: Name of its cable.
        cycles: That the cable had made; NaN where that is not known.
        temperature: [°C]; NaN where it is not known.
        lubricated: 1 if it was, 0 if not, NaN where that is not known.
        values: Draws of equal weight by parameter in shown units, (inspection, draw); NaN where an inspection has no such
            parameter.
        stats: Statistics of each inspection by name: the engine that drew, Pareto k, whether it may be trusted.
        attributes: Unit, symbol, meaning, role and prior of each parameter.
        about: Name, seed and versions of the fleet.
    """

    label: tuple[str, ...]
    cable: tuple[str, ...]
    cycles: Vector
    temperature: Vector
    lubricated: Vector
    values: Mapping[str, np.ndarray]
    stats: Mapping[str, np.ndarray]
    attributes: Mapping[str, Mapping[str, str]]
    about: Mapping[str, Any]


def write_fleet_draws(path: Path, fleet: FleetDraws) -> None:
    """Write fleet.nc whole: groups posterior and sample_stats, with dimensions chain, draw and cable.

    Args:
        path: The file.
        fleet: The draws.
    """
    text = h5py.string_dtype()
    in_memory = io.BytesIO()  # HDF5 does not survive a disk that is full
    with h5netcdf.File(in_memory, "w") as file:
        file.attrs["fleet"] = json.dumps(dict(fleet.about))
        for name in (_POSTERIOR, "sample_stats"):
            group = file.create_group(name)
            group.dimensions["cable"] = len(fleet.label)
            for of_cable, labels in (("cable", fleet.label), ("cable_name", fleet.cable)):
                group.create_variable(of_cable, ("cable",), dtype=text, data=np.array(labels, dtype=object))
            for of_cable, unit in _METADATA.items():
                group.create_variable(of_cable, ("cable",), data=getattr(fleet, of_cable)).attrs["units"] = unit
        posterior, stats = file[_POSTERIOR], file["sample_stats"]
        count = next((draws.shape[1] for draws in fleet.values.values()), 0)
        for dimension, length in (("chain", 1), ("draw", count)):
            posterior.dimensions[dimension] = length
            posterior.create_variable(dimension, (dimension,), data=np.arange(length))
        metadata = " ".join(("cable_name", *_METADATA))
        for name, draws in fleet.values.items():
            variable = posterior.create_variable(name, ("chain", "draw", "cable"), data=draws.T[None])
            variable.attrs.update({**fleet.attributes.get(name, {}), "coordinates": metadata})
        for name, statistic in fleet.stats.items():
            kind = {"dtype": text} if statistic.dtype == object else {}
            data = statistic.astype("int8") if statistic.dtype == bool else statistic
            stats.create_variable(name, ("cable",), data=data, **kind).attrs["coordinates"] = metadata
    with replace_atomically(path) as temporary:
        temporary.write_bytes(in_memory.getbuffer())


def read_fleet_draws(folder: Path) -> FleetDraws:
    """Read the fleet.nc of a results folder.

    Raises:
        StoreError: There is none, or it is damaged.
    """
    path = folder / FLEET_DRAWS
    refuse_special(path, StoreError)
    if not path.is_file():
        problem = "holds an unfinished fleet; finish it with --resume" if folder.is_dir() else "does not exist"
        raise StoreError(f"{path} cannot be read: {folder} {problem}, or name a folder that `bowdenfit fleet` wrote.")
    _refuse_changed(folder, StoreError(f"{path} is damaged; fit the fleet again, or restore the folder from a copy."))
    draws: FleetDraws = read_own_hdf5(path, "bowdenfit.addons.fleet.folder:read_draws_file")
    return draws


def read_draws_file(path: Path) -> FleetDraws:
    """Read a fleet.nc; for `read_own_hdf5`."""
    with h5py.File(path) as file:
        group, stats = (_members(file, name) for name in (_POSTERIOR, "sample_stats"))
        fixed = {"cable", "cable_name", "chain", "draw", *_METADATA}
        values = {name: np.ascontiguousarray(group[name][0].T) for name in group if name not in fixed}
        attributes = {name: {k: v for k, v in group[name].attrs.items() if isinstance(v, str)} for name in values}
        labels, names = (tuple(group[name].asstr()[()]) for name in ("cable", "cable_name"))
        cycles, temperature, lubricated = (np.asarray(group[name][()]) for name in _METADATA)
        statistics = {name: np.asarray(stats[name][()]) for name in stats if name not in fixed}
        about = json.loads(file.attrs["fleet"])
    return FleetDraws(labels, names, cycles, temperature, lubricated, values, statistics, attributes, about)


def _members(file: h5py.File, group: str) -> dict[str, h5py.Dataset]:
    inside = own_member(file, group)
    return {name: own_member(inside, name) for name in inside}


def _refuse_changed(folder: Path, damaged: StoreError) -> None:
    """Refuse draws that are not those that fleet.json was written for.

    Raises:
        StoreError: They are others, or fleet.json is missing or damaged.
    """
    try:
        page = read_page(folder / FLEET_PAGE)
    except FileNotFoundError:
        raise StoreError(f"{folder} holds an unfinished fleet; finish it with `bowdenfit fleet ... --resume`.") from None
    if not isinstance(page, dict):
        raise StoreError(f"{folder / FLEET_PAGE} is damaged; fit the fleet again, or restore the folder from a copy.")
    if page.get(CHECKSUM) != file_checksum(folder / FLEET_DRAWS):  # before HDF5 opens it, which may go in circles for ever
        raise damaged
