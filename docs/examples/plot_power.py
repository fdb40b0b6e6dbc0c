"""
How many participants?
======================

The share of experiments that find a rise of depth with the aperture, by the number of participants and by the size
of the rise. All experiments are simulated: for each, answers are drawn from a model of people, scenes and noise.
"""

import matplotlib.pyplot as plt

from focalgradient.design import DepthRatingDesign
from focalgradient.power import Model, Study, quick_power

numbers = (4, 6, 8, 12, 16)
fig, ax = plt.subplots(figsize=(4.8, 3.2), layout="constrained")
for effect in (1.1, 1.2, 1.3):
    study = Study(Model(effect=effect), DepthRatingDesign())
    power = [quick_power(study, number, experiments=1000)["near_rise"] for number in numbers]
    print(f"{effect:g} times as deep:", ", ".join(f"{n}: {p:.0%}" for n, p in zip(numbers, power, strict=True)))
    ax.plot(numbers, power, "o-", label=f"{effect:g} times as deep")
ax.axhline(0.8, color="0.7", zorder=0)
ax.set(xlabel="participants", ylabel="share that finds the rise", ylim=(0, 1.02), title="simulated experiments")
fig.legend(loc="outside lower center", ncols=3, fontsize="small", columnspacing=1)

# %%
# ``focalgradient power`` runs each experiment from trial list to test: :doc:`../tutorials/power-before-subjects`.
