"""Errors with a memory: autoregression (of a series), moving (white noise beside autocorrelated errors while the robot
moves), beside_white (or always), innovations (what is new in each row, compiled), whitened (the engine whose rows have
forgotten), whitening (a fit made anew with it, and how sure it is). common_errors: errors of channels that go
together."""
