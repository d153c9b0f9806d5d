"""python -m benchmarks.control_real [SEED ...] [PATH ...]"""

import sys

from benchmarks.control_real import main

main(sys.argv[1:])
