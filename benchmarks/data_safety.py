"""Safety of people's data against outsiders, full disks and untrue texts.

    python benchmarks/data_safety.py [LINE ...]

Each row is one fault, with the result before it was fixed, and the present result.
"""

from __future__ import annotations

import data_safety_conduct
import data_safety_server
import files_of_others
import malformed
from reruns import Lines

TABLE = Lines("People's data: what outsiders, full disks and untrue texts could do to them")
data_safety_server.register(TABLE)
data_safety_conduct.register(TABLE)
malformed.register_data(TABLE)
files_of_others.register(TABLE)


if __name__ == "__main__":
    TABLE.main()
