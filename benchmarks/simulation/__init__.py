"""How a robot moves, and how fast: accuracy (50 digits), simulate, inductance, rest, environments, campaigns;
tanh is what they stand beside. Many robots at once: benchmarks/batch.
"""
