"""URDF files of robots whose wheels are meshes or cylinders."""

import math

MESH = '<visual><geometry><mesh filename="package://bot/wheel.stl"/></geometry></visual>'
ROUND = '<collision><geometry><cylinder radius="0.03" length="0.02"/></geometry></collision>'


def urdf_link(name, shape, mass=0.1):
    inertia = '<inertia ixx="1e-5" iyy="1e-5" izz="2e-5" ixy="0" ixz="0" iyz="0"/>'
    return f'<link name="{name}"><inertial><mass value="{mass}"/>{inertia}</inertial>{shape}</link>'


def urdf_joint(name, parent, child, angle, far, axis="1 0 0", kind="continuous"):
    x, y = far * math.cos(angle), far * math.sin(angle)
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/><axis xyz="{axis}"/>'
        f'<origin xyz="{x!r} {y!r} 0.03" rpy="0 0 {angle!r}"/></joint>'
    )


def urdf_robot(degrees, names="wheel_{}", shape=MESH, rollers=0, more=""):
    parts = [urdf_link("base_link", "", 2.5)]
    for k, degree in enumerate(degrees):
        name = names.format(k + 1)
        parts += [urdf_link(name, shape), urdf_joint(f"{name}_joint", "base_link", name, math.radians(degree), 0.1)]
        for r in range(rollers):
            parts += [
                urdf_link(f"{name}_r{r}", ROUND, 0.001),
                urdf_joint(f"{name}_j{r}", name, f"{name}_r{r}", 0.1, 0.03),
            ]
    return f'<robot name="bot">{"".join(parts)}{more}</robot>'
