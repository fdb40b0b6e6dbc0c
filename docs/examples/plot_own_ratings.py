"""
Ratings from a table of your own
================================

A table with one row for each rating is all that the analysis needs. The answers here are **simulated**.
"""

# %%
# A file as a laboratory may have it: participant, aperture, the object in focus, the scene, the rating. Ratings are
# ratios to a standard. With the near object in focus they rise by 30 % at the largest aperture.

import csv
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from focalgradient.plotting.subjects import draw_depth_rating
from focalgradient.statistics import depth_rating, quality, read_ratings

rng = np.random.default_rng(1)
path = Path(tempfile.mkdtemp(), "ratings.csv")
with path.open("w", newline="") as file:
    table = csv.writer(file)
    table.writerow(["person", "stop", "focus", "scene", "rating"])
    for person in range(1, 9):
        own = rng.normal(0, 0.1)  # how much more than others this person rises
        for scene in ("garden", "kitchen", "street", "desk", "stairs", "shelf"):
            for focus in ("near", "far"):
                for stop, share in (("pinhole", 0), ("f/11", 0.5), ("f/5.6", 1)):
                    rise = share * ((np.log(1.3) if focus == "near" else 0) + own)
                    table.writerow([f"p{person}", stop, focus, scene, round(np.exp(rise + rng.normal(0, 0.15)), 3)])

# %%
# Read it, leave out whom the rules leave out, test, and draw every participant with the mean.

own_table = read_ratings(path, {"participant": "person", "aperture": "stop", "fixation": "focus"})
print(*own_table.notes, sep="\n")
kept, excluded = quality(own_table.table)
result = depth_rating(kept, equivalence_bound=1.2)
print(f"{excluded.subjects_after} of {excluded.subjects_before} participants are kept")
print(result.summary())
fig, ax = plt.subplots(figsize=(4.8, 3.6), layout="constrained")
draw_depth_rating(ax, result, simulated=True)

# %%
# ``focalgradient report ratings.csv`` makes the whole report of such a table: :doc:`../own-ratings`.
