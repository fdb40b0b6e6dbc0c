"""Wrong depth without a warning.

    python benchmarks/wrong_depth.py [LINE ...]

Each row is one fault, with the result before it was fixed, and the present result.
"""

from __future__ import annotations

import unit_slips
import wrong_calibration
import wrong_depth_eyes
import wrong_depth_optics
import wrong_depth_views
from reruns import Lines

TABLE = Lines("Depth that was wrong without a word")
wrong_depth_eyes.add_lines(TABLE)
wrong_depth_views.add_lines(TABLE)
wrong_calibration.add_lines(TABLE)
wrong_depth_optics.add_lines(TABLE)
unit_slips.register(TABLE)


if __name__ == "__main__":
    TABLE.main()
