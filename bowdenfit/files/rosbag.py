"""ROS bags: ROS 1 .bag files, and ROS 2 bags as folders or as single .db3 and .mcap files."""

from array import array
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bowdenfit.files.channels import (
    Channel,
    ChannelFile,
    UnreadNames,
    load_library,
    make_channel_file,
    refuse_damage,
    refuse_too_large,
)
from bowdenfit.files.clocks import YEARS

MOST_ELEMENTS = 64  # judged: a longer array is an image or a scan, no set of channels
_HEADER = "header"
_COMPARABLE = 3600 * 10**9  # [ns]; clocks that differ by more do not count from the same moment
_Step = str | int


@dataclass(frozen=True)
class _Leaf:
    """The way to one number in a message: attributes and places in arrays."""

    steps: tuple[_Step, ...]

    def name(self, topic: str) -> str:
        """Return the name of its channel, as "/force_in.wrench.force.x" or "/joints.effort[0]"."""
        return topic + "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in self.steps)

    def value(self, message: Any) -> float:
        """Return the number; NaN where the array of this message is shorter than that of the first."""
        for step in self.steps:
            if isinstance(step, str):
                message = getattr(message, step)
            elif step < len(message):
                message = message[step]
            else:
                return float("nan")
        return float(message)


@dataclass(frozen=True)
class _Topic:
    """The numbers of one topic.

    Args:
        name: The topic.
        leaves: Which numbers its messages have.
        columns: These numbers, one column a leaf.
        nanoseconds: Time of each message.
        clock: Whether that is the "header.stamp" of the messages or their "receive time".
    """

    name: str
    leaves: tuple[_Leaf, ...]
    columns: tuple[array, ...]
    nanoseconds: np.ndarray
    clock: str


def read(path: Path) -> ChannelFile:
    """Read all numeric fields of all topics of a bag.

    The time of a topic is the stamp in the headers of its messages, if all have one that is not zero, else the time
    at which they were received; it counts from the first message of the bag.

    Raises:
        DatasetError: The bag is damaged, too large or without numeric fields, or rosbags is not installed.
    """
    highlevel, typesys = load_library("rosbags.highlevel", "ROS bag"), load_library("rosbags.typesys", "ROS bag")
    left_out = UnreadNames()
    fallback = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    with refuse_damage(path), highlevel.AnyReader([path], default_typestore=fallback) as reader:
        leaves = {name: numbers for name in reader.topics if (numbers := _leaves_of(reader, name, left_out))}
        refuse_too_large(path, sum(reader.topics[name].msgcount * (len(leaves[name]) + 1) for name in leaves))
        topics = [_topic(reader, name, leaves[name]) for name in leaves]
        described = all(connection.msgdef.data for connection in reader.connections)
    remarks = () if described else ("The bag does not describe its messages; those of ROS 2 Humble were assumed.",)
    return make_channel_file(path, "ROS bag", list(_channels(topics)), left_out, remarks)


def _messages(reader: Any, topic: str) -> Iterator[tuple[int, Any]]:
    """Yield the time of receipt [ns] and content of each message of a topic."""
    for connection, received, raw in reader.messages(connections=reader.topics[topic].connections):
        yield received, reader.deserialize(raw, connection.msgtype)


def _leaves_of(reader: Any, topic: str, left_out: UnreadNames) -> tuple[_Leaf, ...]:
    """Return which numbers the messages of a topic have, by the first of them."""
    if not any(connection.msgtype in reader.typestore.fielddefs for connection in reader.topics[topic].connections):
        left_out.add(topic, "the bag does not describe their messages")
        return ()
    first = next(_messages(reader, topic), None)
    leaves = () if first is None else tuple(_Leaf(steps) for steps in _numeric_steps(first[1]))
    if not leaves:
        left_out.add(topic, "their messages hold no numbers, or only long arrays such as images")
    return leaves


def _numeric_steps(value: Any) -> Iterator[tuple[_Step, ...]]:
    """Yield the ways to all numbers in a message, leaving out its header and long arrays."""
    if isinstance(value, (bool, int, float, np.number, np.bool_)):
        yield ()
    elif isinstance(value, (np.ndarray, list, tuple)):
        if len(value) <= MOST_ELEMENTS:
            for number, element in enumerate(value):
                yield from ((number, *steps) for steps in _numeric_steps(element))
    elif hasattr(value, "__dataclass_fields__"):
        for name in value.__dataclass_fields__:
            if name not in (_HEADER, "__msgtype__"):
                yield from ((name, *steps) for steps in _numeric_steps(getattr(value, name)))


def _topic(reader: Any, name: str, leaves: tuple[_Leaf, ...]) -> _Topic:
    """Return all numbers of one topic, message by message."""
    columns = tuple(array("d") for _ in leaves)
    received, stamped = array("q"), array("q")
    for moment, message in _messages(reader, name):
        received.append(moment)
        stamped.append(_stamp(message))
        for leaf, column in zip(leaves, columns, strict=True):
            column.append(leaf.value(message))
    stamps = np.array(stamped, dtype=np.int64)
    if np.all(stamps > 0):
        return _Topic(name, leaves, columns, stamps, "header.stamp")
    return _Topic(name, leaves, columns, np.array(received, dtype=np.int64), "receive time")


def _stamp(message: Any) -> int:
    """Return the stamp in the header of a message [ns]; 0 without one."""
    stamp = getattr(getattr(message, _HEADER, None), "stamp", None)
    return 0 if stamp is None else int(stamp.sec) * 10**9 + int(stamp.nanosec)


def _channels(topics: list[_Topic]) -> Iterator[Channel]:
    """Yield the channels of all topics, in seconds from the first message of the bag."""
    first: dict[str, int] = {}
    for topic in topics:
        first[topic.clock] = min(int(topic.nanoseconds.min()), first.get(topic.clock, 2**63 - 1))
    if first and max(first.values()) - min(first.values()) < _COMPARABLE:
        first = dict.fromkeys(first, min(first.values()))
    for topic in topics:
        time, start = (topic.nanoseconds - first[topic.clock]) / 1e9, first[topic.clock] / 1e9
        for leaf, column in zip(topic.leaves, topic.columns, strict=True):
            values = np.frombuffer(column, dtype=np.float64)
            yield Channel(leaf.name(topic.name), "", values, time, topic.clock, start if start > YEARS else None)
