"""First module of the child server: one thread per child, before numpy decides otherwise.

With as many computing children as cores, the threads of BLAS would only fight each other, and a
server with threads could not be forked safely.
"""

import os

for _name in (
    "MKL_NUM_THREADS",
    "NUMEXPR_NUM_THREADS",
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
):
    os.environ[_name] = "1"
