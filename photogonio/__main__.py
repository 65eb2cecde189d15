"""``python -m photogonio``."""

from photogonio.cli import program

program()
