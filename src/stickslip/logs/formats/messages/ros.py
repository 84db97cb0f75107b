"""Bags of ROS 1 and ROS 2, and MCAP files of any encoding, as columns."""

import json
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any

from stickslip.errors import RequiredExtra
from stickslip.logs.formats.messages.topics import Message, table_of_topics
from stickslip.logs.table import Table

_FIRST = 50  # messages of a topic that show its columns

_LARGEST_MESSAGE = 65_536
"""Bytes of a message with numbers over time: larger ones are images and scans."""

_MAGIC = b"\x89MCAP0\r\n"
SIGNATURES = {".bag": b"#ROSBAG V", ".mcap": _MAGIC, ".db3": b"SQLite format 3\0"}
"""First bytes of a bag, by the ending of its name."""

_CONTROL_TYPES = {
    "control_msgs/msg/InterfaceValue": "string[] interface_names\nfloat64[] values\n",
    "control_msgs/msg/DynamicJointState": (
        "std_msgs/Header header\nstring[] joint_names\ncontrol_msgs/InterfaceValue[] "
        "interface_values\n"
    ),
}
"""Definitions of messages that the library lacks and old bags do not hold."""


def read_bag(path: Path) -> Table:
    """Read the topics of a ROS bag: a .bag or .db3 file, or the folder of a ROS 2 bag.

    Messages are read with the definitions in the bag, or else those of the latest ROS 2. Time is
    that of the message headers, or else that of the recorder.
    """
    with RequiredExtra("ros", f"{path.name} is a ROS bag; reading it"):
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_types_from_msg, get_typestore
    path = _File(path)
    store = get_typestore(Stores.LATEST)
    for name, definition in _CONTROL_TYPES.items():
        if name not in store.types:
            store.register(get_types_from_msg(definition, name))
    with AnyReader([path], default_typestore=store) as reader:
        topics, unreadable = _first_messages(reader)
    notes = [f"topic {topic} is left out ({why})" for topic, why in unreadable.items()]

    def messages(names: Sequence[str]) -> Iterator[Message]:
        with AnyReader([path], default_typestore=store) as reader:
            wanted = [each for each in reader.connections if each.topic in names]
            yield from _decoded(reader, wanted)

    return table_of_topics(path.name, topics, messages, notes)


class _File(type(Path())):
    """A path whose ending is in lower case, by which the library distinguishes the kinds of bags.

    A file without a known ending, such as standard input, has that of its first bytes.
    """

    @property
    def suffix(self) -> str:
        ending = super().suffix.lower()
        if ending in SIGNATURES or not self.is_file():
            return ending
        with self.open("rb") as file:
            head = file.read(max(map(len, SIGNATURES.values())))
        return next((each for each, own in SIGNATURES.items() if head.startswith(own)), ending)


def _first_messages(reader: Any) -> tuple[list[Message], dict[str, str]]:
    """Return the first messages of every topic, and why others cannot be read."""
    first: list[Message] = []
    unreadable: dict[str, str] = {}
    for connection in reader.connections:
        try:
            first += islice(_decoded(reader, [connection]), _FIRST)
        except _TooLarge:
            continue
        except (KeyError, ValueError, RuntimeError) as error:
            if type(error).__name__ == "ReaderError":  # the bag, not the message
                raise
            unreadable[connection.topic] = f"its type {connection.msgtype} is not known"
    return first, unreadable


class _TooLarge(Exception):  # noqa: N818
    """A message is an image or a scan."""


def _decoded(reader: Any, connections: Sequence[Any]) -> Iterator[Message]:
    for connection, sent, raw in reader.messages(connections=connections):
        if len(raw) > _LARGEST_MESSAGE:
            raise _TooLarge
        yield Message(
            topic=connection.topic,
            type_name=connection.msgtype.replace("/msg/", "/"),
            sent=sent,
            content=reader.deserialize(raw, connection.msgtype),
        )


def read_mcap(path: Path) -> Table:
    """Read the topics of an MCAP file: ROS 2, ROS 1, protobuf or JSON messages."""
    if _is_ros_2(path):
        return read_bag(path)
    with RequiredExtra("ros", f"{path.name} is an MCAP file; reading it"):
        from mcap.reader import make_reader
    with path.open("rb") as file:
        reader = make_reader(file)
        summary = reader.get_summary()
        if summary is None:  # without an index all messages are read
            first = list(_mcap_messages(reader, None))
        else:
            first = [
                message
                for topic in sorted({each.topic for each in summary.channels.values()})
                for message in islice(_mcap_messages(reader, [topic]), _FIRST)
            ]

    def messages(names: Sequence[str]) -> Iterator[Message]:
        with path.open("rb") as file:
            yield from _mcap_messages(make_reader(file), names)

    return table_of_topics(path.name, first, messages)


def _is_ros_2(path: Path) -> bool:
    """Return whether the profile in the header of an MCAP file is that of ROS 2."""
    with path.open("rb") as file:
        head = file.read(64)
    return head.startswith(_MAGIC) and head[21:25] == b"ros2"


def _mcap_messages(reader: Any, topics: Sequence[str] | None) -> Iterator[Message]:
    decoders: dict[int, Any] = {}
    for schema, channel, message in reader.iter_messages(topics=topics):
        if len(message.data) > _LARGEST_MESSAGE:
            continue
        if channel.id not in decoders:
            decoders[channel.id] = _decoder(channel.message_encoding, schema)
        decode = decoders[channel.id]
        if decode is not None:
            yield Message(
                topic=channel.topic,
                type_name=schema.name if schema is not None else "",
                sent=message.publish_time or message.log_time,
                content=decode(message.data),
            )


def _swapped(read: Callable[[bytes, str], Any], name: str, data: bytes) -> Any:
    return read(data, name)


def _decoder(encoding: str, schema: Any) -> Any:
    """Return the function that decodes the messages of a channel, or None for other encodings."""
    if encoding == "json":
        return json.loads
    if encoding == "protobuf":
        with RequiredExtra("ros", "reading protobuf messages"):
            from mcap_protobuf.decoder import DecoderFactory
        return DecoderFactory().decoder_for(encoding, schema)
    if encoding in {"ros1", "cdr"} and schema is not None:
        from rosbags.typesys import Stores, get_types_from_msg, get_typestore

        store = get_typestore(Stores.EMPTY)
        name = schema.name if "/msg/" in schema.name else schema.name.replace("/", "/msg/")
        store.register(get_types_from_msg(schema.data.decode(), name))
        read = store.deserialize_ros1 if encoding == "ros1" else store.deserialize_cdr
        return partial(_swapped, read, name)
    return None
