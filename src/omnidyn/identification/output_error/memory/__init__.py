"""Errors with a memory: autoregression (of a series), mixed (white noise beside errors that remember), moving (beside
errors that remember only while the robot moves), innovations (what is new in each row, compiled), whitened (the engine
whose rows have forgotten), whitening (a fit made anew with it, and how sure it is), across (channels whose errors go
together)."""
