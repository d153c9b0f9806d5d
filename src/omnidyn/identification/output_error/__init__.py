"""Output error: the model runs freely under the logged inputs, and its numbers are those whose outputs fit best.

    y_k = h(x(t_k - latency), u; p) + e_k,     x' = f(x, u; p)       maximum likelihood over p, one or many runs

Nothing measured feeds back into the model, so noise on the outputs does not bias it, as it does where measured speeds
are differentiated or put into a regressor. In the order of the work:

    parameters    what is free, between which bounds, on which scale
    nuisances     what a log does to a model that is right: latency, gain, dead band, sag, the start
    record        a Run as the kernels read it
    primitives    from the robot to the numbers of the exact step and of the outputs, and their derivatives
    kernel        one march through the log: residuals, gradient and information, in memory that does not grow
    solver        Levenberg-Marquardt
    starts        where it begins
    uncertainty   how far the answer can be trusted
    fit           fit_output_error
"""
