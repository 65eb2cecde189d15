"""``python -m photogonio``."""

import sys

from photogonio.cli import main

sys.exit(main())
