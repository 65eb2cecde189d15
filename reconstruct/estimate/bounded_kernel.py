"""Small quadratic problems with bounds, compiled: a few lobe coefficients, for each fold and channel."""

from __future__ import annotations

import numpy as np

from photogonio.capture.jit import jit

FREE, LOW, HIGH = range(3)
KKT_SLACK = 1e-10  # of the largest moment: rounding


@jit
def bounded(gram, moment, upper, patterns, result):
    """The x (n, q) in [0, ``upper``] (q,) of least x^T gram x - 2 x^T moment, of n problems (n, q, q) and (n, q).

    It is that of the first of the ``patterns`` (p, q) of active bounds, FREE, LOW or HIGH each, that meets the
    conditions of Karush, Kuhn and Tucker; where rounding leaves none, the last one's x, cut to the bounds.
    """
    q = len(upper)
    system, right, where, x = np.empty((q, q)), np.empty(q), np.empty(q, np.int64), np.empty(q)
    for n in range(len(moment)):
        slack = 0.0
        for k in range(q):
            slack = max(slack, abs(moment[n, k]))
        slack *= KKT_SLACK
        for p in range(len(patterns)):
            free = 0
            for k in range(q):
                x[k] = upper[k] if patterns[p, k] == HIGH else 0.0
                if patterns[p, k] == FREE:
                    where[free] = k
                    free += 1
            for i in range(free):
                right[i] = moment[n, where[i]]
                for k in range(q):
                    right[i] -= gram[n, where[i], k] * x[k]
                for j in range(free):
                    system[i, j] = gram[n, where[i], where[j]]
            solved(system, right, free)
            for i in range(free):
                x[where[i]] = right[i]
            if _meets(gram[n], moment[n], upper, patterns[p], slack, x):
                break
        for k in range(q):
            result[n, k] = min(max(x[k], 0.0), upper[k])


@jit
def _meets(gram, moment, upper, pattern, slack, x):
    for k in range(len(x)):
        if not (x[k] >= 0.0 and x[k] <= upper[k]):
            return False
    for k in range(len(x)):
        if pattern[k] != FREE:
            uphill = -moment[k]
            for j in range(len(x)):
                uphill += gram[k, j] * x[j]
            if (uphill if pattern[k] == LOW else -uphill) < -slack:
                return False
    return True


@jit
def solved(system, right, count):
    """The first ``count`` of ``right`` become the solution of that part of ``system``, both of which are overwritten:
    Gauss's elimination, the largest pivot first."""
    for i in range(count):
        best = i
        for j in range(i + 1, count):
            if abs(system[j, i]) > abs(system[best, i]):
                best = j
        if best != i:
            for k in range(count):
                system[i, k], system[best, k] = system[best, k], system[i, k]
            right[i], right[best] = right[best], right[i]
        for j in range(i + 1, count):
            part = system[j, i] / system[i, i]
            for k in range(i + 1, count):
                system[j, k] -= part * system[i, k]
            right[j] -= part * right[i]
    for i in range(count - 1, -1, -1):
        for k in range(i + 1, count):
            right[i] -= system[i, k] * right[k]
        right[i] /= system[i, i]
