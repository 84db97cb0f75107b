"""ROS bags and MCAP files beyond one topic of joint states."""

import json
from contextlib import contextmanager

import numpy as np
import pytest
from mcap.writer import Writer as McapWriter
from message_files import (
    JOINTS,
    START,
    joint_columns,
    stamps_of,
    write_dynamic_joint_states,
    write_ros_2,
)
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from sample_files import read

from stickslip.logs import LogSchema, read_log


@pytest.mark.parametrize("plugin", StoragePlugin)
def test_the_folder_of_a_bag_with_two_topics(plugin, columns, tmp_path):
    folder = tmp_path / "bag"
    write_ros_2(folder, columns, plugin, topics=("/left", "/right"))
    table, loaded = read(folder)
    assert [group.time for group in table.groups] == ["/left/time", "/right/time"]
    position, _, _ = joint_columns(columns)
    np.testing.assert_array_equal(loaded["/right/wrist/position"], position[:, 2])
    assert table.place("/right/time", 4) == "bag, message 5 of /right"
    log = read_log(
        folder,
        LogSchema(
            kind="rotary", time="/left/time", position="/left/elbow/position",
            effort="/left/elbow/effort",
        ),
    )  # fmt: skip
    np.testing.assert_array_equal(log.time, columns["time"])
    assert log.name == "bag"


def test_interfaces_of_ros2_control_are_named_by_joint(columns, tmp_path):
    write_dynamic_joint_states(tmp_path / "bag", columns)
    _, loaded = read(tmp_path / "bag")
    for quantity, values in zip(
        ("position", "velocity", "effort"), joint_columns(columns), strict=True
    ):
        for k, joint in enumerate(JOINTS):
            np.testing.assert_array_equal(
                loaded[f"/dynamic_joint_states/{joint}/{quantity}"], values[:, k]
            )


def write_types(folder, columns):
    """Write a message of a type of its own, without header, beside one of text."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    store.register(
        get_types_from_msg("float64 current\nfloat32[3] phases\nbool enabled\n", "my/msg/Drive")
    )
    with Writer2(folder, version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        drive = writer.add_connection("/drive", "my/msg/Drive", typestore=store)
        text = writer.add_connection("/text", "std_msgs/msg/String", typestore=store)
        for k, stamp in enumerate(stamps_of(columns["time"])):
            message = store.types["my/msg/Drive"](
                current=columns["effort"][k], phases=np.full(3, k, np.float32), enabled=k > 3
            )
            writer.write(drive, stamp, store.serialize_cdr(message, "my/msg/Drive"))
            message = store.types["std_msgs/msg/String"](data="ready")
            writer.write(text, stamp, store.serialize_cdr(message, "std_msgs/msg/String"))


def test_numbers_of_any_type_by_the_time_of_the_recorder(columns, tmp_path):
    write_types(tmp_path / "bag", columns)
    table, loaded = read(tmp_path / "bag")
    phases = [f"/drive/phases[{k}]" for k in range(3)]
    assert list(table.headers) == ["/drive/time", "/drive/current", *phases, "/drive/enabled"]
    np.testing.assert_array_equal(loaded["/drive/current"], columns["effort"])
    np.testing.assert_array_equal(loaded["/drive/phases[2]"], np.arange(60.0))
    np.testing.assert_array_equal(loaded["/drive/time"], columns["time"])
    assert any("those of the recorder" in note for note in table.notes)


@contextmanager
def json_messages(path):
    """Yield a function that writes a message of a topic, as JSON, at a time [ns]."""
    with path.open("wb") as file:
        writer = McapWriter(file)
        writer.start()
        schema = writer.register_schema("states", "jsonschema", b"{}")
        channels = {}

        def send(topic, content, sent):
            if topic not in channels:
                channels[topic] = writer.register_channel(topic, "json", schema)
            writer.add_message(channels[topic], sent + 2, json.dumps(content).encode(), sent)

        yield send
        writer.finish()


def test_publishers_of_other_joints_on_one_topic_are_groups(columns, tmp_path):
    with json_messages(tmp_path / "two.mcap") as send:
        for k, stamp in enumerate(stamps_of(columns["time"])):
            arm = {"name": ["a", "b"], "position": [k, 2 * k]}
            hand = {"name": ["grip"], "position": [3 * k]}
            for content in (arm, hand) if k % 2 else (arm,):
                moment = {"stamp": {"sec": stamp // 10**9, "nsec": stamp % 10**9}}
                send("/states", {"header": moment, **content}, stamp + 3)
    table, loaded = read(tmp_path / "two.mcap")
    assert [group.name for group in table.groups] == ["/states/1", "/states/2"]
    np.testing.assert_array_equal(loaded["/states/b/position"], 2.0 * np.arange(60))
    np.testing.assert_array_equal(loaded["/states/grip/position"], 3.0 * np.arange(1, 60, 2))
    np.testing.assert_array_equal(loaded["/states/2/time"], columns["time"][1::2])
    assert not any("recorder" in note for note in table.notes)


def test_stamps_of_another_clock_stay_as_they_are(columns, tmp_path):
    with json_messages(tmp_path / "clocks.mcap") as send:
        for k in range(10):
            for topic, start in (("/sim", 5 * 10**9), ("/real", START)):
                stamp = start + k * 10**7
                moment = {"sec": stamp // 10**9, "nsec": stamp % 10**9}
                send(topic, {"timestamp": moment, "x": k}, START + k)
    _, loaded = read(tmp_path / "clocks.mcap")
    np.testing.assert_allclose(loaded["/sim/time"], 5.0 + np.arange(10) / 100, rtol=1e-15)
    np.testing.assert_array_equal(loaded["/real/time"], np.arange(10) / 100)
