"""The paper's law without an error of integration.

step is THE formula, slopes its partial derivatives, position how far the body gets in a step, exact_march a whole run
of it. With winding inductance: inductance_step, inductance.
"""
