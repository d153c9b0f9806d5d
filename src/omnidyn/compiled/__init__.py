"""How machine code is made of Python functions, kept on disk, and never served stale.

`kernel`: the one way to compile: entry points and the parts they are made of. `stamp`: what the machine code of a
kernel depends on. `entries`: its place on disk. `warmed`: that all of them are there. `linking`: parts are optimised
once, in the kernel that calls them. `private`: the switch of what is private to numba. `hearing`: who waits for a
compiler can hear of it. `beside`: several runs of kernels at a time. `elsewhere`: another process compiles meanwhile.
Read `kernel` first.
"""
