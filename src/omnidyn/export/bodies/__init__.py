"""Robots for simulators of bodies and joints. shape: inertias, wheels, friction that all of them share.

mjcf: MuJoCo. links: base and wheels as links and joints, which urdf and sdf write down.
"""
