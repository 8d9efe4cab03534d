"""Valid binary files made invalid, or at least odd: by damage, and by hands that know how such files say how large they are."""

import random
import struct
import zipfile
import zlib
from collections.abc import Callable
from io import BytesIO

ODD_NUMBERS = (0, 1, 2, 7, 8, 255, 2**15, 2**16 - 1, 2**31 - 1, 2**31, 2**32 - 1, 2**40, 2**63 - 1, 2**64 - 1)
Mangle = Callable[[random.Random, bytes], bytes]


def bits(chance: random.Random, content: bytes) -> bytes:
    """A few bytes changed, most of them near the beginning or the end, where files describe themselves."""
    changed = bytearray(content)
    for _ in range(chance.choice([1, 1, 2, 8])):
        changed[_place(chance, len(changed))] = chance.choice([0, 1, 0x7F, 0x80, 0xFF, chance.randrange(256)])
    return bytes(changed)


def number(chance: random.Random, content: bytes) -> bytes:
    """Another size, count or place."""
    form = chance.choice(["<B", "<H", "<I", "<I", "<Q", "<Q", ">I", ">Q"])
    size = struct.calcsize(form)
    index = min(_place(chance, len(content)) // min(size, 4) * min(size, 4), max(len(content) - size, 0))
    packed = struct.pack(form, chance.choice(ODD_NUMBERS) % 256**size)
    return content[:index] + packed + content[index + size :]


def cut(chance: random.Random, content: bytes) -> bytes:
    """Its end is missing, or something in the middle."""
    index = _place(chance, len(content))
    return content[:index] if chance.random() < 0.5 else content[:index] + content[index + chance.choice([1, 4, 8, 64]) :]


def again(chance: random.Random, content: bytes) -> bytes:
    """A piece stands there twice, elsewhere, or is empty."""
    index, to, size = _place(chance, len(content)), _place(chance, len(content)), chance.choice([4, 16, 64, 512])
    piece = chance.choice([content[index : index + size], bytes(size), b"\xff" * size])
    return content[:to] + piece + content[to + chance.choice([0, len(piece)]) :]


def nothing(chance: random.Random, content: bytes) -> bytes:
    """As it is."""
    return content


def _place(chance: random.Random, size: int) -> int:
    near = min(int(chance.expovariate(1 / 150)), size - 1)
    return chance.choice([near, size - 1 - near, chance.randrange(size)])


ANY: tuple[Mangle, ...] = (bits, bits, number, number, number, cut, again)


def mangled(chance: random.Random, content: bytes) -> bytes:
    """One file mangled; what is packed inside it at times, and packed again.

    Args:
        chance: What decides.
        content: The valid file.
    """
    if content.startswith(b"PK\x03\x04") and chance.random() < 0.6:
        return _member(chance, content)
    if content.startswith(b"MATLAB 5") and chance.random() < 0.5:
        return _element(chance, content)
    for _ in range(chance.choice([1, 1, 2])):
        content = chance.choice(ANY)(chance, content) or b"\0"
    return content


def _member(chance: random.Random, content: bytes) -> bytes:
    """An archive with one of its members mangled, encrypted as it says, or packed in an unheard-of way."""
    made = BytesIO()
    with zipfile.ZipFile(BytesIO(content)) as initial, zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as after:
        chosen = chance.choice(initial.namelist())
        for name in initial.namelist():
            member = initial.read(name)
            for _ in range(name == chosen and chance.choice([1, 2, 3])):
                member = chance.choice(ANY)(chance, member) or b"\0"
            after.writestr(name, member)
    packed = bytearray(made.getvalue())
    if chance.random() < 0.3:  # flags and ways of packing stand in two places
        flag, how = chance.choice([0, 1, 0x41, 8]), chance.choice([8, 0, 9, 12, 14, 99])
        for mark, value in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
            position = packed.find(mark)
            struct.pack_into("<HH", packed, position + value, flag, how)
    return bytes(packed)


def _element(chance: random.Random, content: bytes) -> bytes:
    """A file of MATLAB with its first variable mangled where it is unpacked."""
    kind, size = struct.unpack_from("<II", content, 128)
    inside, tail = content[136 : 136 + size], content[136 + size :]
    if kind == 15:
        inside = zlib.compress(chance.choice(ANY)(chance, zlib.decompress(inside)))
    else:
        inside = chance.choice(ANY)(chance, inside)
    return content[:128] + struct.pack("<II", kind, len(inside)) + inside + tail
