"""A sampler's checkpoint file: a fingerprint of the run, then one record after the other, each either complete or absent.

The file only grows. Where the disk is full or the process ends in the middle of a record, the records before it remain valid,
and sampling continues after them. (HDF5 keeps its index all over the file, and a failed write leaves it unreadable.)
"""

import io
import json
import os
import struct
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, BinaryIO
from zlib import crc32

import numpy as np

from bowdenfit.errors import StoreError, disk_error
from bowdenfit.inputs import damage_as, open_arrays, refuse_special
from bowdenfit.outputs import open_in_place

_MARK = b"bowdenfit checkpoint 1\n"
_RECORD_HEADER = struct.Struct("<QI")  # length and checksum of a record
_LONGEST_FINGERPRINT = 1 << 24  # bytes; a longer fingerprint is damage
Record = dict[str, np.ndarray]


def checkpoint_header(fingerprint: Mapping[str, Any]) -> bytes:
    """Return the first bytes of a checkpoint.

    Args:
        fingerprint: Data, settings and seed that identify the run, as plain data.
    """
    return _MARK + json.dumps(fingerprint).encode() + b"\n"


def read_fingerprint(path: Path) -> dict[str, Any]:
    """Read what a checkpoint was started for.

    Raises:
        ValueError: The file is not a checkpoint.
        OSError: It cannot be read.
    """
    refuse_special(path, StoreError)
    with path.open("rb") as file:
        return _parse_fingerprint(file)


def read_records(path: Path, shapes: Mapping[str, tuple[int, ...]]) -> list[Record]:
    """Read all complete records in order; cut off what follows the last complete one.

    Args:
        path: The checkpoint.
        shapes: Shapes of the numeric arrays of a record, by name.

    Raises:
        StoreError: It cannot be read, or holds other records.
    """
    refuse_special(path, StoreError)
    damaged = damaged_checkpoint_error(path)
    try:
        with damage_as(damaged), open_in_place(path, "r+b") as file:
            _parse_fingerprint(file)
            complete, end = list[Record](), file.tell()
            for record in _complete_records(file):
                complete.append(record)
                end = file.tell()
            if any({n: a.shape for n, a in record.items() if a.dtype.kind in "biuf"} != shapes for record in complete):
                raise damaged
            file.truncate(end)
    except OSError as error:
        raise disk_error(path, error) from None
    return complete


def damaged_checkpoint_error(path: Path) -> StoreError:
    """Return the error that says a checkpoint is damaged.

    Args:
        path: The checkpoint.
    """
    return StoreError(f"{path} is damaged and cannot be resumed; start over with --force.")


def append_record(path: Path, record: Mapping[str, np.ndarray]) -> None:
    """Append a record to a checkpoint.

    Args:
        path: The checkpoint, started with `checkpoint_header`.
        record: Named arrays.

    Raises:
        StoreError: The disk is full, or the file cannot be written.
    """
    buffer = io.BytesIO()
    save: Any = np.savez  # its stub takes arrays for its own keywords
    save(buffer, **record)
    content = buffer.getvalue()
    try:
        with open_in_place(path, "ab") as file:
            file.write(_RECORD_HEADER.pack(len(content), crc32(content)) + content)
    except OSError as error:
        raise disk_error(path, error) from None


def _parse_fingerprint(file: BinaryIO) -> dict[str, Any]:
    if file.readline(len(_MARK)) != _MARK:
        raise ValueError("no checkpoint")
    return dict(json.loads(file.readline(_LONGEST_FINGERPRINT)))


def _complete_records(file: BinaryIO) -> Iterator[Record]:
    while len(head := file.read(_RECORD_HEADER.size)) == _RECORD_HEADER.size:
        length, checksum = _RECORD_HEADER.unpack(head)
        content = file.read(min(length, os.fstat(file.fileno()).st_size))
        if len(content) < length or crc32(content) != checksum:
            return
        with open_arrays(io.BytesIO(content)) as arrays:
            yield dict(arrays)
