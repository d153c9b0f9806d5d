"""What is proportional and should be equal: scale, mistakes (of units), lag; derivatives (positions and their
speeds) and turn_rate (a gyroscope against the wheels).
"""
