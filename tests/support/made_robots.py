"""Small robots in URDF, SDF and MJCF."""

HUBS = {
    "rotor_0": (0.2, -0.15),
    "rotor_1": (-0.2, 0.15),
    "rotor_2": (0.2, 0.15),
    "rotor_3": (-0.2, -0.15),
}


def urdf(
    joints: str = "",
    base: str = '<box size="0.3 0.2 0.06"/>',
    blade: str = "package://craft/meshes/prop.stl",
) -> str:
    """A quadrotor of URDF whose propellers are a file in millimetres, each turned by its joint's
    origin.
    """
    links = "".join(
        f'<link name="{name}"><visual><geometry><mesh filename="{blade}" scale="0.001 0.001'
        f' 0.001"/></geometry></visual></link><joint name="{name}_joint" type="continuous"><origin'
        f' xyz="{x} {y} 0.05" rpy="0 0 {index}"/><parent link="base"/><child link="{name}"/><axis'
        ' xyz="0 0 1"/></joint>'
        for index, (name, (x, y)) in enumerate(HUBS.items())
    )
    body = f'<link name="base"><visual><geometry>{base}</geometry></visual></link>'
    return f'<robot name="craft">{body}{links}{joints}</robot>'


SDF = """<sdf version="1.9"><model name="base"><pose>0 0 1 0 0 0</pose>
<link name="hull"><visual name="v"><geometry><box><size>0.3 0.2 0.1</size></box></geometry></visual></link>
<link name="pusher"><pose>-0.3 0 0 0 1.5707963267948966 0</pose><visual name="v"><geometry><cylinder>
<radius>0.1</radius><length>0.01</length></cylinder></geometry></visual></link>
<joint name="pusher_joint" type="revolute"><pose>0 0 0.02 0 0 0</pose><parent>hull</parent><child>pusher</child>
<axis><xyz>0 0 1</xyz><limit><lower>-1e16</lower><upper>1e16</upper></limit></axis></joint>
<link name="aileron"><visual name="v"><pose>0 0.2 0 0 0 0</pose><geometry><box><size>0.1 0.2 0.01</size></box>
</geometry></visual></link><joint name="servo" type="revolute"><parent>hull</parent><child>aileron</child><axis>
<xyz>0 1 0</xyz><limit><lower>-0.5</lower><upper>0.5</upper></limit></axis></joint></model></sdf>"""

MJCF = """<mujoco><compiler angle="degree" meshdir="."/><default><default class="blade">
<mesh scale="0.01 0.01 0.01"/><geom type="mesh" group="1"/><joint type="hinge" axis="0 0 1"/></default></default>
<asset><mesh class="blade" name="p" file="prop.stl"/></asset><worldbody><geom type="plane" size="1 1 1"/>
<body name="hull" pos="0 0 0.5"><freejoint/><geom type="box" size="0.15 0.1 0.03"/>
<geom type="box" size="9 9 9" group="3"/>
<body name="rotor_a" pos="0.3 0 0" euler="0 90 0" childclass="blade"><joint pos="0 0 0.1"/><geom mesh="p"/></body>
<body name="rotor_b" pos="-0.3 0 0" quat="0 1 0 0" childclass="blade"><joint axis="0 0 2"/><geom mesh="p"/></body>
<body name="fin" pos="0 0.1 0"><joint name="fin" axis="0 1 0" range="-20 20"/><geom type="capsule" size="0.01"
fromto="0 0 0 0 0.1 0"/></body></body></worldbody></mujoco>"""


def car_urdf(turned: bool = False) -> str:
    """A car along x, or turned by a quarter along y: four wheels, of which those at the front are
    steered, and a steering wheel that turns without end."""
    links = []
    joints = []
    for name, x, y in (("fl", 1.3, 0.8), ("fr", 1.3, -0.8), ("rl", -1.3, 0.8), ("rr", -1.3, -0.8)):
        links.append(
            f'<link name="wheel{len(links)}"><visual><origin rpy="1.5707963 0'
            ' 0"/><geometry><cylinder radius="0.3" length="0.2"/></geometry></visual></link>'
        )
        parent = "base"
        if name[0] == "f":
            parent = f"knuckle_{len(links)}"
            joints.append(
                f'<link name="{parent}"/><joint name="steer{len(links)}" type="revolute"><origin'
                f' xyz="{x} {y} 0.3"/><parent link="base"/><child link="{parent}"/><axis xyz="0 0'
                ' 1"/><limit lower="-0.5" upper="0.5"/></joint>'
            )
            x = y = 0.0
        joints.append(
            f'<joint name="axle{len(links)}" type="continuous"><origin xyz="{x} {y}'
            f' {0.3 if parent == "base" else 0}"/><parent link="{parent}"/><child'
            f' link="wheel{len(links) - 1}"/><axis xyz="0 1 0"/></joint>'
        )
    helm = (
        '<link name="steering_wheel"><visual><geometry><cylinder radius="0.2" '
        'length="0.03"/></geometry></visual>'
        '</link><joint name="column" type="continuous"><origin xyz="0.4 0.4 0.9"/><parent '
        'link="base"/>'
        '<child link="steering_wheel"/><axis xyz="0 0 1"/></joint>'
    )
    base = (
        '<link name="base"><visual><origin xyz="0 0 0.75"/><geometry><box size="4.2 1.6 '
        '1.1"/></geometry></visual>'
        "</link>"
    )
    yaw = 1.5707963267948966 if turned else 0
    root = (
        f'<link name="world"/><joint name="w" type="fixed"><origin rpy="0 0 {yaw}"/><parent'
        ' link="world"/><child link="base"/></joint>'
    )
    return f'<robot name="car">{root}{base}{"".join(links)}{"".join(joints)}{helm}</robot>'
