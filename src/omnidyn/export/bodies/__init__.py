"""Robots for simulators of bodies and joints.

mjcf: MuJoCo. links: base and wheels as links and joints, which urdf and sdf write down.
"""
