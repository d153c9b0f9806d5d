"""Commands about what holds a robot at rest: deadzone (in volts), friction (in newtons)."""
