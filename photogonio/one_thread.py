"""Linear algebra on one thread of its own, set before anything imports numpy.

OpenBLAS shares even small products out to all cores: the many small systems of a fit took up to fifteen times as long
for waiting on one another, and sums came out in another order on a machine of other cores. What is worth several
cores is shared out by view or by row instead. A user's own setting of the variables is kept.
"""

import os

for _name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"):
    os.environ.setdefault(_name, "1")
