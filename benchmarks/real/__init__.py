"""On logs of real robots, from OMNIDYN_DATA: real_fit, of real_loop, real_nuisances, udea (by choose_motor: options of
a motor by logs left out); robotino_page writes a page of the documentation.
"""
