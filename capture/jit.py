"""How numba compiles loops: kept on disk, known by all their code, without the interpreter's lock, as numpy divides."""

import numba

from photogonio.capture.compiled import keep_fresh

keep_fresh()

jit = numba.njit(cache=True, nogil=True, error_model="numpy")
# a b + c in one step
contracted = numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
inlined = numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"}, inline="always")
# sums in the order that fills the vector lanes
in_lanes = numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "reassoc"})
# For what makes no array but only works on those of its callers. numba counts the references to every array that a
# tuple or a row brings along, by atomic operations: of a ray through the room, which meets a dozen arrays in each of
# its calls, they were nine tenths of the time. A function that does make an array fails to compile so;
# one that gave an array back would give away what is its caller's: numbers alone are returned.
borrowing = numba.njit(cache=True, nogil=True, error_model="numpy", _nrt=False)
