"""Worlds whose answer is known: scenes rendered from known BRDFs, with their truth."""
