"""Reports that stated what was not so about people.

    python benchmarks/wrong_statements.py [LINE ...]

One row for each fault: what it gave before it was fixed, and what it gives now.
"""

from __future__ import annotations

from reruns import Lines

TABLE = Lines("Reports that stated what was not so about people")


if __name__ == "__main__":
    TABLE.main()
