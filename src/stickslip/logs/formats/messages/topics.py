"""Messages of topics, as columns: one group of columns for each structure that messages have."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from stickslip.logs.table import Column, RateGroup, Table
from stickslip.records import InputError

_LARGEST_ARRAY = 100
"""Numbers in an array whose columns are listed: a longer one is an image or a scan."""

_DEEPEST = 10  # levels of nested messages
_AT_ONCE = 5_000  # messages that are kept as they are before their numbers are copied

_CARRIERS = frozenset({"values", "value", "data", "interface_values"})
"""Fields that add nothing to the names of what they hold."""

_JOINT_STATE = "sensor_msgs/JointState"
_STAMPS = frozenset({"stamp", "timestamp"})
_SECONDS, _NANOSECONDS = ("sec", "secs", "seconds"), ("nanosec", "nsec", "nsecs", "nanos")
_OTHER_CLOCK = 86_400 * 10**9
"""Stamps that are a day [ns] away from the others are of another clock, and stay as they are."""

Structure = tuple[tuple[str, int], ...]


class Message(NamedTuple):
    """One message, and when it was sent by the time stamp of the container [ns]."""

    topic: str
    type_name: str
    sent: int
    content: Any


@dataclass
class _Rows:
    """Messages of one structure, of which only blocks are kept as numbers."""

    stamps: list[int] = field(default_factory=list[int])
    values: list[list[Any]] = field(default_factory=list[list[Any]])
    blocks: list[np.ndarray] = field(default_factory=list[np.ndarray])
    stamped: bool = True  # by the messages themselves

    def add(self, stamp: int, values: list[Any]) -> None:
        self.stamps.append(stamp)
        self.values.append(values)
        if len(self.values) >= _AT_ONCE:
            self.pack()

    def pack(self) -> None:
        if self.values:
            n = len(self.values)
            parts = [
                np.concatenate(each) if isinstance(each[0], np.ndarray) else np.array(each)
                for each in zip(*self.values, strict=True)
            ]
            columns = [each.astype(np.float64).reshape(n, -1) for each in parts]
            self.blocks.append(np.concatenate(columns, axis=1))
            self.values = []

    def matrix(self) -> np.ndarray:
        self.pack()
        return np.concatenate(self.blocks)


def table_of_topics(
    label: str,
    first: Iterable[Message],
    messages: Callable[[Sequence[str]], Iterable[Message]],
    notes: Sequence[str] = (),
) -> Table:
    """Return the table of a log of messages.

    ``first`` are the first messages of every topic, which show the columns; ``messages`` returns
    all of some topics. Time counts from the first stamp of all.
    """
    found = _collected(first)
    began = [rows.stamps[0] for rows, _ in found.values()]
    start = min((each for each in began if max(began) - each < _OTHER_CLOCK), default=0)
    structures = {key: f"/{number}" for number, key in enumerate(found, 1)}
    by_topic: dict[str, int] = {}
    for topic, _ in found:
        by_topic[topic] = by_topic.get(topic, 0) + 1
    origins: dict[str, str] = {}
    groups: list[RateGroup] = []
    places: dict[str, tuple[tuple[str, Structure], int]] = {}
    unstamped: list[str] = []
    for (topic, structure), (rows, type_name) in found.items():
        suffix = structures[topic, structure] if by_topic[topic] > 1 else ""
        names = [f"{topic}{suffix}/time"]
        names += _unique([f"{topic}{path}" for path in _paths(structure)], places)
        for position, name in enumerate(names):
            places[name] = ((topic, structure), position - 1)
            origins[name] = f"{topic} ({type_name})" if type_name else topic
        groups.append(RateGroup(columns=tuple(names), time=names[0], name=topic + suffix))
        if not rows.stamped:
            unstamped.append(topic)
    if not groups:
        raise InputError("no_numbers_in_topics", where=label)
    noted = list(notes)
    if unstamped:
        listed = ", ".join(dict.fromkeys(unstamped))
        noted.append(f"time stamps of {listed} are those of the recorder: the messages have none")

    def load(names: Sequence[str]) -> dict[str, Column]:
        topics = list(dict.fromkeys(places[name][0][0] for name in names))
        collected = _collected(messages(topics))
        loaded: dict[str, Column] = {}
        matrices: dict[tuple[str, Structure], np.ndarray] = {}
        for name in names:
            key, position = places[name]
            rows, _ = collected[key]
            if position < 0:
                stamps = np.array(rows.stamps, dtype=np.int64)
                other = abs(int(stamps[0]) - start) > _OTHER_CLOCK
                loaded[name] = (stamps - (0 if other else start)) / 1e9
            else:
                if key not in matrices:
                    matrices[key] = rows.matrix()
                loaded[name] = matrices[key][:, position].copy()
        return loaded

    return Table(
        label=label,
        headers={name: name for name in places},
        units={group.time: "s" for group in groups if group.time},
        load=load,
        place=lambda name, sample: f"{label}, message {sample + 1} of {places[name][0][0]}",
        notes=tuple(noted),
        groups=tuple(groups),
        origins=origins,
    )


def _unique(names: list[str], taken: Mapping[str, object]) -> list[str]:
    """Return the names, with a number behind those that another structure has too."""
    unique: list[str] = []
    for name in names:
        number, own = 1, name
        while own in taken or own in unique:
            number += 1
            own = f"{name} #{number}"
        unique.append(own)
    return unique


def _paths(structure: Structure) -> Iterator[str]:
    """Yield the path of each column of a structure."""
    for path, size in structure:
        if size == 0:
            yield path
        else:
            yield from (f"{path}[{k}]" for k in range(size))


def _collected(messages: Iterable[Message]) -> dict[tuple[str, Structure], tuple[_Rows, str]]:
    """Return the numbers of messages, by topic and structure."""
    collected: dict[tuple[str, Structure], tuple[_Rows, str]] = {}
    known: dict[tuple[Any, ...], _Rows] = {}  # of joint states, which are many and all alike
    for message in messages:
        like = _joint_state(message) if message.type_name == _JOINT_STATE else None
        if like is not None and (rows := known.get(like.key)) is not None:
            rows.add(like.stamp, like.values)
            continue
        leaves = _Leaves()
        leaves.visit(message.content, "", 0)
        structure = tuple(leaves.structure)
        if not structure:
            continue
        key = (message.topic, structure)
        if key not in collected:
            collected[key] = (_Rows(), message.type_name)
        rows, _ = collected[key]
        rows.stamped = rows.stamped and leaves.stamp is not None
        rows.add(message.sent if leaves.stamp is None else leaves.stamp, leaves.values)
        if like is not None:
            known[like.key] = rows
    return collected


class _JointState(NamedTuple):
    """Key of the structure of joint states, the stamp [ns] and the arrays."""

    key: tuple[Any, ...]
    stamp: int
    values: list[Any]


def _joint_state(message: Message) -> _JointState | None:
    """Return the arrays of a joint state without a search; None for one that has no stamp."""
    content = message.content
    if isinstance(content, Mapping):
        return None
    arrays = (content.position, content.velocity, content.effort)
    sizes = [len(each) for each in arrays]
    stamp = content.header.stamp.sec * 10**9 + content.header.stamp.nanosec
    if not stamp or max(sizes) > _LARGEST_ARRAY:
        return None
    key = (message.topic, *content.name, *sizes)
    return _JointState(key, stamp, [each for each in arrays if len(each)])


class _Leaves:
    """Numbers of one message with their paths, and its own stamp [ns]."""

    def __init__(self) -> None:
        self.structure: list[tuple[str, int]] = []
        self.values: list[Any] = []
        self.stamp: int | None = None

    def visit(self, content: Any, path: str, depth: int, labels: tuple[str, ...] = ()) -> None:
        """Add the numbers of a message or of a part of it; ``labels`` name the items of arrays."""
        if depth > _DEEPEST:
            return
        items = _items(content)
        for _, value in items:
            own = _texts(value)
            if own:
                labels = own
                break
        for name, value in items:
            if depth <= 1 and name in _STAMPS and self.stamp is None:
                moment = _moment(value)
                if moment:
                    self.stamp = moment
                    continue
            if name == "header" and depth == 0:
                self._header(value)
            else:
                self._leaf(value, path, name, depth, labels)

    def _header(self, header: Any) -> None:
        moment = _moment(dict(_items(header)).get("stamp"))
        if moment:
            self.stamp = moment

    def _leaf(self, value: Any, path: str, name: str, depth: int, labels: tuple[str, ...]) -> None:
        kind = type(value)
        if kind is float or kind is int or kind is bool:
            self.structure.append((f"{path}/{name}", 0))
            self.values.append(value)
        elif kind is np.ndarray:
            if value.dtype.kind in "biuf" and value.ndim == 1 and 0 < value.size <= _LARGEST_ARRAY:
                self._array(value, path, name, labels)
        elif kind is str or kind is bytes or value is None:
            return
        elif _is_sequence(value):
            self._sequence(value, path, name, depth, labels)
        elif (moment := _moment(value)) is not None:
            self.structure.append((f"{path}/{name}", 0))
            self.values.append(moment * 1e-9)
        else:
            self.visit(value, f"{path}/{name}", depth + 1, labels)

    def _array(self, value: Any, path: str, name: str, labels: tuple[str, ...]) -> None:
        if len(value) == len(labels):
            suffix = "" if name in _CARRIERS else f"/{name}"
            self.structure += [(f"{path}/{label}{suffix}", 0) for label in labels]
            self.values.append(np.asarray(value, dtype=np.float64))
        else:
            self.structure.append((f"{path}/{name}", len(value)))
            self.values.append(np.asarray(value, dtype=np.float64))

    def _sequence(
        self, value: Any, path: str, name: str, depth: int, labels: tuple[str, ...]
    ) -> None:
        if not 0 < len(value) <= _LARGEST_ARRAY or _texts(value):
            return
        if all(isinstance(each, int | float) for each in value):
            self._array(value, path, name, labels)
        elif not isinstance(value[0], int | float | str | bytes | list):
            for k, each in enumerate(value):
                if len(value) == len(labels):
                    own = f"{path}/{labels[k]}" + ("" if name in _CARRIERS else f"/{name}")
                else:
                    own = f"{path}/{name}[{k}]"
                self.visit(each, own, depth + 1)


def _is_sequence(value: Any) -> bool:
    return isinstance(value, list | tuple) or (
        hasattr(value, "__len__") and hasattr(value, "append") and not hasattr(value, "items")
    )


def _texts(value: Any) -> tuple[str, ...]:
    """Return a list of names as a tuple; nothing if it is none."""
    if not _is_sequence(value) or not 0 < len(value) <= _LARGEST_ARRAY:
        return ()
    return tuple(value) if all(type(each) is str for each in value) else ()


def _items(content: Any) -> list[tuple[str, Any]]:
    """Return the fields of a message of any library."""
    if isinstance(content, Mapping):
        return [(str(name), value) for name, value in content.items()]
    descriptor = getattr(content, "DESCRIPTOR", None)
    if descriptor is not None:
        return [
            (each.name, getattr(content, each.name))
            for each in descriptor.fields
            if each.message_type is None or _is_repeated(each) or content.HasField(each.name)
        ]
    return [(name, getattr(content, name)) for name in _fields(type(content))]


def _is_repeated(descriptor: Any) -> bool:
    repeated = getattr(descriptor, "is_repeated", None)
    return descriptor.label == descriptor.LABEL_REPEATED if repeated is None else bool(repeated)


@cache
def _fields(kind: type) -> tuple[str, ...]:
    return tuple(name for name in getattr(kind, "__dataclass_fields__", ()) if name[0] != "_")


def _moment(value: Any) -> int | None:
    """Return a time stamp or a duration [ns], in seconds and nanoseconds; None for other parts."""
    if value is None or isinstance(value, int | float | str | bytes | list | np.ndarray):
        return None
    parts = dict(_items(value))
    if len(parts) != 2:
        return None
    seconds = next((parts[name] for name in _SECONDS if name in parts), None)
    nanoseconds = next((parts[name] for name in _NANOSECONDS if name in parts), None)
    if not isinstance(seconds, int) or not isinstance(nanoseconds, int):
        return None
    return seconds * 10**9 + nanoseconds
