"""A file format: columns with bars between them, names and units in the first line."""

import numpy as np

from bowdenfit.files.channels import Channel, ChannelFile


def read(path):
    """All columns."""
    heads, *rows = (line.split("|") for line in path.read_text(encoding="utf-8").splitlines())
    numbers = np.array(rows, dtype=float)
    return ChannelFile(
        path,
        "bars",
        tuple(Channel(name, unit, numbers[:, k]) for k, (name, unit) in enumerate(head.split(":") for head in heads)),
    )
