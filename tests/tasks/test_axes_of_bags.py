"""The joints of a ROS bag: found, distinguished from commands, and read as from a table."""

import numpy as np
import pytest
import seven_joints

pytest.importorskip("rosbags")

from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from stickslip.logs import LogSchema, read_axes
from stickslip.tasks import inspect

START = 1_700_000_000 * 10**9
KIND = "sensor_msgs/msg/JointState"


@pytest.fixture(scope="module")
def columns():
    time = np.arange(300) * 0.002
    made = {"__time": time}
    for k, name in enumerate(seven_joints.JOINTS):
        made[f"/joint_states/{name}/position"] = np.sin(3 * time + k)
        made[f"/joint_states/{name}/effort"] = np.cos(5 * time + k)
    return made


@pytest.fixture(params=[StoragePlugin.SQLITE3, StoragePlugin.MCAP])
def bag(request, tmp_path, columns):
    """Write joint states, and commands at half the rate on a topic of their own."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    types, joints = store.types, seven_joints.JOINTS
    path = tmp_path / "robot"
    with Writer(path, version=9, storage_plugin=request.param) as writer:
        states = writer.add_connection("/joint_states", KIND, typestore=store)
        commands = writer.add_connection("/joint_command", KIND, typestore=store)
        for k, second in enumerate(columns["__time"]):
            stamp = START + round(second * 1e9)
            message = types[KIND](
                header=types["std_msgs/msg/Header"](
                    stamp=types["builtin_interfaces/msg/Time"](
                        sec=stamp // 10**9, nanosec=stamp % 10**9
                    ),
                    frame_id="",
                ),
                name=list(joints),
                position=np.array([columns[f"/joint_states/{n}/position"][k] for n in joints]),
                velocity=np.array([]),
                effort=np.array([columns[f"/joint_states/{n}/effort"][k] for n in joints]),
            )
            writer.write(states, stamp + 3_000_000, store.serialize_cdr(message, KIND))
            if k % 2 == 0:
                writer.write(commands, stamp + 4_000_000, store.serialize_cdr(message, KIND))
    return path


def test_joints_of_a_bag(bag, columns):
    logs = read_axes(bag, LogSchema(kind="rotary"))
    assert sorted(logs) == sorted(seven_joints.JOINTS)
    for name, log in logs.items():
        np.testing.assert_allclose(log.time - log.time[0], columns["__time"], atol=1e-6)
        np.testing.assert_array_equal(
            log.measured_position, columns[f"/joint_states/{name}/position"]
        )
        np.testing.assert_array_equal(log.effort, columns[f"/joint_states/{name}/effort"])


def test_inspection_of_a_bag(bag):
    found = inspect(bag, schema=LogSchema(kind="rotary"))
    assert found.trusted
    rates = {name: rate for name, rate in found.rates.items() if rate}
    assert sorted(round(rate) for rate in rates.values()) == [250, 500]
    assert len(found.axes) == 7
