"""What is proportional and should be equal: scale, turn_rate (a gyroscope against the wheels), mistakes (of units),
lag; derivatives (positions and their speeds).
"""
