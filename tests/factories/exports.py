"""Documents of estimates and robot descriptions to export into, written by hand."""

from typing import Any

UNITS = {
    "rotary": {"inertia": "kg m^2", "viscous_friction": "N m s/rad", "effort": "N m"},
    "linear": {"mass": "kg", "viscous_friction": "N s/m", "effort": "N"},
}
INERTIA, COULOMB, VISCOUS = 0.05, 0.5, 0.2


def unit_of(name: str, kind: str) -> str:
    plain = name.removesuffix("_positive").removesuffix("_negative")
    if plain == "stribeck_velocity":
        return "rad/s" if kind == "rotary" else "m/s"
    if plain == "quadratic_friction":
        return "N m s^2/rad^2" if kind == "rotary" else "N s^2/m^2"
    return UNITS[kind].get(plain, UNITS[kind]["effort"])


def document(kind: str = "rotary", status: str = "ok", **changes: Any) -> dict[str, Any]:
    """Return an estimate as ``stickslip identify --json`` writes it.

    ``changes`` are values by name, or (value, unit); None is not identified, and "absent" leaves a
    parameter out. Standard deviations are 1 % of the values.
    """
    body = "inertia" if kind == "rotary" else "mass"
    values: dict[str, Any] = {
        body: INERTIA,
        "viscous_friction": VISCOUS,
        "coulomb_friction": COULOMB,
    } | changes
    parameters: dict[str, Any] = {}
    for name, given in values.items():
        if given == "absent":
            continue
        value, unit = given if isinstance(given, tuple) else (given, unit_of(name, kind))
        std = None if value is None else 0.01 * abs(value)
        ci95 = None if std is None else [value - 2.0 * std, value + 2.0 * std]
        parameters[name] = {"value": value, "std": std, "ci95": ci95, "unit": unit}
    identified = [each["std"] for each in parameters.values() if each["std"] is not None]
    return {
        "schema": 1,
        "estimator": "auto",
        "kind": kind,
        "parameters": parameters,
        "covariance": [
            [std**2 if k == j else 0.0 for j in range(len(identified))]
            for k, std in enumerate(identified)
        ],
        "status": status,
        "diagnostics": {
            "verdicts": [
                {
                    "parameter": name,
                    "identifiable": each["value"] is not None,
                    "reason": "it moves one way only" if each["value"] is None else "it moves",
                }
                for name, each in parameters.items()
            ]
        },
        "provenance": {
            "stickslip_version": "0.1.0",
            "files": ["elbow--test.csv"],
            "input_sha256": "0123456789abcdef",
            "options": {"estimator": "auto", "inertia": None},
        },
    }


URDF = """\
<?xml version="1.0"?>
<!-- A robot -->
<robot name="arm">
  <link name="base"/>
  <link name="link">
    <inertial>
      <mass value="1"/>
      <inertia ixx="0.05" iyy="0.05" izz="0.05" ixy="0" ixz="0" iyz="0"/>
    </inertial>
  </link>
  <link name="tool">
    <inertial>
      <mass value="0.05"/>
      <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/>
    </inertial>
  </link>
  <joint name="elbow" type="continuous">
    <parent link="base"/> <child link="link"/>  <axis xyz='0 0 1'/>
  </joint>
  <joint type="prismatic" name="slide"><parent link="base"/><child link="tool"/>\
<axis xyz="1 0 0"/><limit lower="-9" upper="9" effort="10" velocity="9"/></joint>
  <link name="plate>1"/>
  <joint name="weld" type="fixed"><parent link="tool"/><child link="plate>1"/></joint>
  <transmission name="t"><type>x</type><joint name="elbow"/></transmission>
</robot>
"""

SDF = """\
<?xml version='1.0'?>
<sdf version="1.9">
  <model name="arm">
    <link name="base"/>
    <link name="link"/>
    <link name="tool"/>
    <joint name="elbow" type="revolute">
      <parent>base</parent>
      <child>link</child>
      <axis>
        <xyz>0 0 1</xyz>   <!-- up -->
      </axis>
    </joint>
    <joint name="slide" type="prismatic">
      <parent>base</parent><child>tool</child>
      <axis><xyz>1 0 0</xyz><dynamics><spring_stiffness>3</spring_stiffness></dynamics></axis>
    </joint>
  </model>
</sdf>
"""

MJCF = """\
<mujoco model="arm">
  <!-- degrees -->
  <compiler angle="degree"/>
  <option timestep='0.001' gravity="0 0 0"/>
  <default>
    <default class="stiff"><joint damping="9" type="slide"/></default>
  </default>
  <worldbody>
    <body>
      <joint name="elbow" axis="0 0 1" range="-9000 9000"/>
      <inertial pos="0 0 0" mass="1" diaginertia="0.05 0.05 0.05"/>
    </body>
    <body pos="0 0 1"><joint name="slide" class="stiff" axis="1 0 0"
        /><inertial pos="0 0 0" mass="0.05" diaginertia="0.01 0.01 0.01"/></body>
  </worldbody>
</mujoco>
"""

USD = """\
#usda 1.0
(
    defaultPrim = "arm"
    metersPerUnit = 1
    upAxis = "Z"
)

def Xform "arm" (
    prepend apiSchemas = ["PhysicsArticulationRootAPI"]
)
{
    def Scope "joints"
    {
        def PhysicsRevoluteJoint "elbow"
        {
            uniform token physics:axis = "Z"
        }

        def PhysicsPrismaticJoint "slide"
        {
            uniform token physics:axis = "X"
        }
    }
}
"""

ROBOTS = {"urdf": URDF, "sdf": SDF, "mjcf": MJCF, "usd": USD}
"""A robot description by target: joint ``elbow`` turns and ``slide`` slides."""
