"""On logs of real robots, from OMNIDYN_DATA: real_fit, of real_loop, real_nuisances, udea; robotino_page writes a page
of the documentation.
"""
