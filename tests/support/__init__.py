"""What several folders of tests share, or tests and benchmarks. No test stands here, and no reference.

Robots
    robots            Table 3, random robots that the exact engine serves, programs of voltages; from a seed
    mixed_robots      random robots that mix every option of the plant, and voltages for them; from a seed
    friction_shapes   the paper's robot with every shape of friction
    strategies        robots, wheels and voltages for Hypothesis
    robot_keys        the keys of a robot file, from the script that makes their page
Logs
    axebot_logs       of the axebot, to identify its friction from
    steady_logs       under held voltages in many directions, with friction of each shape
    compared_logs     to compare a robot with
    pushed_logs       one clean log to break
    random_logs       clean logs of random robots through sensors like those in shops
    real_logs         of real robots, read as their owner would read them
Truths and outputs
    march_cases       random runs, and all that their sensors would show
    run_differences   derivatives as differences of whole runs
    outputs           strict JSON, HTML
    figures           the texts that a figure shows

High-precision references and the scripts that make them stand in tests/reference.
"""
