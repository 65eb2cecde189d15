"""Tests keep no results in the user's cache, and find none there."""

import os

os.environ["PHOTOGONIO_CACHE"] = ""
