"""Robots for simulators of bodies and joints.

inertias: what they ask beyond the model. mjcf: MuJoCo; feet: its dry friction; free_base: a body that falls. links:
base and wheels as links and joints, which urdf and sdf write down.
"""
