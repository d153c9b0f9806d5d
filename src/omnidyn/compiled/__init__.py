"""How machine code is made of Python functions, kept on disk, and never served stale.

`kernel`: the one way to compile: entry points and the parts they are made of. `stamp`: what the machine code of a
kernel depends on. `entries`: its place on disk, and how it is loaded. `warmed`: that all of them are there. `private`:
the switch of what is private to numba. `listeners`: who waits for a compiler can hear of it. `parallel`: several runs
of kernels at a time, and a process that compiles meanwhile. `trace`: a function of arrays as a formula;
`scalar_function`: that of plain numbers, in microseconds. Read `kernel` first.
"""
