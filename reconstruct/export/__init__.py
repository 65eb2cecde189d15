"""Files that renderers and other tools open."""
