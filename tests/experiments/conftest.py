"""The experiments' programs lie in one folder and import one another by name: let tests do so too."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "experiments"))
