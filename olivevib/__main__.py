"""``python -m olivevib``."""

import sys

from olivevib.cli import main

sys.exit(main())
