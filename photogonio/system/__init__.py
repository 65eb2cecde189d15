"""How does a run treat files, terminal and memory?

Gives outputs whole or not at all, progress, provenance.
"""
