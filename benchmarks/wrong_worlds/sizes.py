"""How wrong each kind is: (small, large), drawn beforehand by pilot.py on seeds of its own, beside what was measured.

Biases in standard errors; where a fit of the pilot did not end, the size goes on in proportion.
"""

SIZES: dict[str, tuple[float, float]] = {
    "fade": (0.00914, 0.0334),  # 5.4, 19.9
    "gain": (0.00576, 0.0213),  # 5.3, 19.8
    "current limit": (0.62, 0.849),  # 5.1, 17.7
    "voltage drop": (0.03, 0.106),  # 5.7, 20.2
    "dead band": (0.0388, 0.144),  # 5.2, 19.7
    "gear loss": (0.05, 0.177),  # 4.9, 19.7
    "rotors": (0.202, 0.698),  # 5.5, 19.4
    "weak motor": (0.0115, 0.0643),  # 5.5, 18.7
    "resistance": (0.1, 0.352),  # 5.7, 17.5
    "wheel radius": (0.0423, 0.153),  # 5.5, 20.4
    "one wheel": (0.0457, 0.0838),  # 5.2, 19.3
    "robot radius": (0.328, 0.5),  # 5.2, 7.3
    "mass": (0.314, 1),  # 5.5, 14.1
    "inertia": (0.738, 2.06),  # 5.1, 20.4
    "turning frame": (0.304, 1),  # 6.3, 12.2
    "tilt": (0.0279, 0.0969),  # 5.7, 22.0
    "payload": (1.91, 3),  # 4.9, 6.1
    "floor": (0.1, 0.348),  # 5.8, 19.7
    "battery swap": (0.00831, 0.06),  # 6.2, not measured
    "breakaway": (1.01, 1.35),  # 11.1, 20.5
    "ellipse": (0.0339, 0.0519),  # 7.8, 16.4
    "box": (0.146, 0.454),  # 6.4, 18.4
    "wheels": (0.00759, 0.0183),  # 5.1, 21.3
    "latency": (0.0101, 0.0375),  # 5.5, not measured
    "sag": (0.119, 0.434),  # 5.5, 20.2
    "heating": (0.412, 1.55),  # 5.3, 17.8
    "off centre": (0.0328, 0.07),  # 4.7, 20.5
    "backward": (0.116, 0.43),  # 5.4, 17.2
    "Stribeck": (0.856, 1.36),  # 5.9, 25.5
    "drag": (0.3, 1.14),  # 5.3, 19.8
    "warming": (0.457, 0.9),  # 5.5, 10.8
    "umbilical": (0.8, 2.29),  # 7.0, 20.5
    "slip": (0.719, 0.829),  # 5.6, 21.5
    "eccentric": (0.105, 0.285),  # 5.1, 18.0
    "rollers": (0.06, 0.1),  # 5.3, 18.0
    "cogging": (0.492, 1.16),  # 5.4, 18.6
    "backlash": (0.00354, 0.0123),  # 5.7, 16.8
    "jitter": (1.24, 3),  # 4.8, 7.5
    "filter": (0.011, 0.04),  # 4.7, not measured
    "slow driver": (0.04, 0.08),  # not measured: 1.7 at 0.02
}
