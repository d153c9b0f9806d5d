"""Commands about this installation: warm.py compiles what first runs need, doctor.py says what it is made of."""
