"""Benchmarks: linear algebra runs as the command line has it."""

import photogonio  # noqa: F401  sets its threads, before anything imports numpy
