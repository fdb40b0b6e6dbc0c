"""
How depth is found
==================

Every candidate distance is tried: how well does one sharp scene, blurred as each view blurs at that distance, explain
all views together? Drawn is that likelihood for a patch of wall at 1.25 m, with one view, two apertures, and two foci.
"""

# %%
# A textured wall, seen through a 25 mm lens with one per cent of noise.

import matplotlib.pyplot as plt
import numpy as np

from focalgradient import Lens, cast
from focalgradient.depth.equalise.patch import vergence_likelihood
from focalgradient.render import noisy
from focalgradient.scenes import plane

TRUE = 1.25
lenses = {
    "f/5.6, focus 1 m": Lens(focal_length=0.025, f_number=5.6, focus_distance=1.0),
    "f/16, focus 1 m": Lens(focal_length=0.025, f_number=16, focus_distance=1.0),
    "f/5.6, focus 1.6 m": Lens(focal_length=0.025, f_number=5.6, focus_distance=1.6),
}
pixel = 8e-6 / lenses["f/5.6, focus 1 m"].sensor_distance
views = {}
for number, (name, lens) in enumerate(lenses.items()):
    seen = cast(plane(TRUE, seed=3), lens, (96, 96), pixel).view
    views[name] = noisy(seen, 0.01 * float(seen.image.mean()), number)

# %%
# The cost of a candidate is minus twice the logarithm of its likelihood. One view gives blur only as far as the
# texture is as natural as assumed here, and near and far look alike. Two apertures show the same texture twice, so
# that nothing need be assumed of it; the side of the focus stays open. Two foci decide that, too.

candidates = np.linspace(0.4, 1.6, 241)  # dioptres
cases = {
    "one view": ["f/5.6, focus 1 m"],
    "two apertures": ["f/5.6, focus 1 m", "f/16, focus 1 m"],
    "two foci": ["f/5.6, focus 1 m", "f/5.6, focus 1.6 m"],
}
fig, ax = plt.subplots(figsize=(6.4, 3.6), layout="constrained")
for (name, chosen), colour in zip(cases.items(), ("#999999", "#0072b2", "#d55e00"), strict=True):
    noise = 0.01 * float(np.mean([views[one].image.mean() for one in chosen]))
    log_likelihood = vergence_likelihood([views[one] for one in chosen], candidates, noise=noise)
    best = candidates[np.argmax(log_likelihood)]
    ax.plot(candidates, -2 * log_likelihood, color=colour, label=f"{name}: {1 / best:.2f} m")
ax.axvline(1 / TRUE, color="black", linestyle=":", label=f"true: {TRUE} m")
ax.axvline(1.0, color="#cccccc", linestyle="--", label="focus: 1 m")
ax.set(xlabel="vergence of the candidate (D)", ylabel="cost over the least", yscale="symlog", ylim=(0, 1e6))
fig.legend(loc="outside lower center", ncols=3, fontsize="small")
