"""Robots for simulators of bodies and joints.

inertias: what they ask beyond the model. mjcf: MuJoCo. links: base and wheels as links and joints, which urdf and sdf
write down.
"""
