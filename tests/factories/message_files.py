"""Logs of messages as the libraries of their formats write them."""

import json
from pathlib import Path

import numpy as np
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from mcap.writer import Writer as McapWriter
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

START = 1_700_000_000 * 10**9
"""Stamp of the first message [ns]."""

JOINTS = ("shoulder", "elbow", "wrist")
TOPIC = "/joint_states"


def stamps_of(time):
    """Return the stamps [ns] of times [s], rounded."""
    return [START + round(each * 1e9) for each in time]


def _joint_state(store, stamp, joints, position, velocity, effort, **header):
    """Return a message of three joints."""
    types = store.types
    moment = types["builtin_interfaces/msg/Time"](sec=stamp // 10**9, nanosec=stamp % 10**9)
    return types["sensor_msgs/msg/JointState"](
        header=types["std_msgs/msg/Header"](stamp=moment, frame_id="", **header),
        name=list(joints),
        position=np.array(position),
        velocity=np.array(velocity),
        effort=np.array(effort),
    )


def joint_columns(columns):
    """Return position, velocity and effort of each joint, shape (samples, joints)."""
    scale = np.arange(1, len(JOINTS) + 1)
    return [np.outer(columns[name], scale) for name in ("position", "velocity", "effort")]


def write_ros_1(path, columns):
    """Write joint states as a ROS 1 bag."""
    store = get_typestore(Stores.ROS1_NOETIC)
    states = zip(stamps_of(columns["time"]), *joint_columns(columns), strict=True)
    with Writer1(path) as writer:
        kind = "sensor_msgs/msg/JointState"
        connection = writer.add_connection(TOPIC, kind, typestore=store)
        for number, (stamp, *state) in enumerate(states):
            message = _joint_state(store, stamp, JOINTS, *state, seq=number)
            writer.write(connection, stamp + 7_000_000, store.serialize_ros1(message, kind))


def write_ros_2(path, columns, plugin=StoragePlugin.SQLITE3, topics=(TOPIC,)):
    """Write joint states as the folder of a ROS 2 bag; receive times are 7 ms late."""
    states = list(zip(stamps_of(columns["time"]), *joint_columns(columns), strict=True))
    _write_states(path, JOINTS, states, plugin, topics)


def _write_states(path, joints, states, plugin, topics=(TOPIC,)):
    store = get_typestore(Stores.ROS2_HUMBLE)
    with Writer2(path, version=9, storage_plugin=plugin) as writer:
        kind = "sensor_msgs/msg/JointState"
        for topic in topics:
            connection = writer.add_connection(topic, kind, typestore=store)
            for stamp, *state in states:
                raw = store.serialize_cdr(_joint_state(store, stamp, joints, *state), kind)
                writer.write(connection, stamp + 7_000_000, raw)


def write_ros_2_file(path, columns, plugin):
    """Write the one file that a ROS 2 bag has in its folder."""
    folder = path.with_name(f"{path.name}-bag")
    write_ros_2(folder, columns, plugin)
    _only_file(folder, path)


def _only_file(folder, path):
    (file,) = folder.glob(f"*{path.suffix}")
    file.rename(path)


def write_robot(path, joints, columns):
    """Write columns with the names of PlotJuggler as joint states without velocities, in MCAP."""
    position, effort = (
        np.stack([columns[f"{TOPIC}/{joint}/{name}"] for joint in joints], axis=1)
        for name in ("position", "effort")
    )
    stamps = [round(each * 1e9) for each in columns["__time"]]
    states = [(stamp, q, [], tau) for stamp, q, tau in zip(stamps, position, effort, strict=True)]
    folder = path.with_name(f"{path.name}-bag")
    _write_states(folder, joints, states, StoragePlugin.MCAP)
    _only_file(folder, path)
    return path


def write_dynamic_joint_states(path, columns):
    """Write the joint states of ros2_control, whose interfaces have names of their own."""
    definitions = {
        "control_msgs/msg/InterfaceValue": "string[] interface_names\nfloat64[] values\n",
        "control_msgs/msg/DynamicJointState": "std_msgs/Header header\nstring[] joint_names\n"
        "control_msgs/InterfaceValue[] interface_values\n",
    }
    store = get_typestore(Stores.ROS2_HUMBLE)
    for name, text in definitions.items():
        store.register(get_types_from_msg(text, name))
    types, kind = store.types, "control_msgs/msg/DynamicJointState"
    with Writer2(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connection = writer.add_connection("/dynamic_joint_states", kind, typestore=store)
        for stamp, *state in zip(stamps_of(columns["time"]), *joint_columns(columns), strict=True):
            moment = types["builtin_interfaces/msg/Time"](sec=stamp // 10**9, nanosec=stamp % 10**9)
            values = [
                types["control_msgs/msg/InterfaceValue"](
                    interface_names=["position", "velocity", "effort"], values=np.array(each)
                )
                for each in zip(*state, strict=True)
            ]
            message = types[kind](
                header=types["std_msgs/msg/Header"](stamp=moment, frame_id=""),
                joint_names=list(JOINTS),
                interface_values=values,
            )
            writer.write(connection, stamp + 7_000_000, store.serialize_cdr(message, kind))


def write_mcap_json(path, columns):
    """Write every sample as a JSON message in an MCAP file."""
    with Path(path).open("wb") as file:
        writer = McapWriter(file)
        writer.start()
        schema = writer.register_schema("stage", "jsonschema", b'{"type": "object"}')
        channel = writer.register_channel("/stage", "json", schema)
        names = [name for name in columns if name != "time"]
        for k, stamp in enumerate(stamps_of(columns["time"])):
            content = {name: float(columns[name][k]) for name in names}
            writer.add_message(channel, stamp + 7_000_000, json.dumps(content).encode(), stamp)
        writer.finish()


def write_mcap_protobuf(path, columns):
    """Write every sample as a protobuf message in an MCAP file."""
    names = [name for name in columns if name != "time"]
    file_type = descriptor_pb2.FileDescriptorProto(name="stage.proto", syntax="proto3")
    message_type = file_type.message_type.add(name="Stage")
    for number, name in enumerate(names, 1):
        message_type.field.add(name=name, number=number, type=1, label=1)  # double, optional
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file_type)
    make = message_factory.GetMessageClass(pool.FindMessageTypeByName("Stage"))
    described = descriptor_pb2.FileDescriptorSet(file=[file_type]).SerializeToString()
    with Path(path).open("wb") as file:
        writer = McapWriter(file)
        writer.start()
        schema = writer.register_schema("Stage", "protobuf", described)
        channel = writer.register_channel("/stage", "protobuf", schema)
        for k, stamp in enumerate(stamps_of(columns["time"])):
            content = make(**{name: float(columns[name][k]) for name in names})
            writer.add_message(channel, stamp + 7_000_000, content.SerializeToString(), stamp)
        writer.finish()
