"""Tests keep no results in the user's cache, and find none there; linear algebra as the command line has it."""

import os

import photogonio  # noqa: F401  sets the threads of linear algebra, before anything imports numpy

os.environ["PHOTOGONIO_CACHE"] = ""
