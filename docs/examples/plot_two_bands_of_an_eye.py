"""
Two views in one eye
====================

The eye focuses blue light from nearer than red light. What its L and M cones see and what its S cones see at
one moment are therefore two views with two foci, and depth follows from them, on either side of focus.
"""

# %%
# Walls at several distances, each seen by an eye that accommodates to 1 m; the S cones resolve 10 cycles per degree.

import matplotlib.pyplot as plt
import numpy as np

from focalgradient import Eye, recover_depth
from focalgradient.eye import band_views

eye = Eye(pupil_diameter=0.004, accommodation=1.0)
true = np.array([0.25, 0.6, 1.0, 1.5, 2.0])  # D
found = []
for vergence in true:
    seen = band_views(1 / vergence, eye, (128, 128), np.radians(1 / 60), noise=0.01, seed=1)
    depth = recover_depth([one.view for one in seen])
    found.append(np.median(depth.vergence[depth.valid]))

# %%
# Vergence as it is and as it is estimated; dotted, the focus of either cone class.

fig, ax = plt.subplots(figsize=(4.2, 4), layout="constrained")
ax.plot([0, 2.2], [0, 2.2], color="0.7")
ax.plot(true, found, "o", color="#0072b2")
for one in seen:
    ax.axvline(one.view.optics.focus_vergence, color="0.4", linestyle=":")
    ax.text(one.view.optics.focus_vergence, 2.1, f" {one.view.optics.light}", color="0.4")
ax.set(xlabel="vergence of the wall (D)", ylabel="estimated vergence (D)", aspect="equal")
