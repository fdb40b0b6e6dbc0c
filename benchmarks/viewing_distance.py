"""Error of viewing distances that simulated people measure with a card and their blind spot.

`python benchmarks/viewing_distance.py [--people 4000]`. People differ in the onset of their blind spot (12.5 +- 0.85
degrees) and in reaction time (0.3 +- 0.06 s; 0.05 s between presses), match a card to 0.5 mm, move their head by 2 %
between presses, and press at random in 3 of 100. Distances are 40 to 80 cm, pixels 0.1 to 0.3 mm. The estimate is
compared with that of the plugin, which assumes 13.5 degrees for any display.
"""

from __future__ import annotations

import argparse
import math
from dataclasses import dataclass

import numpy as np

from focalgradient.display import CARD
from focalgradient.web.screen import STEP_PX, measure

REPETITIONS = 5


@dataclass(frozen=True)
class Did:
    """Measurements of a person at a known distance."""

    distance: float
    pixel: float
    card_px: float
    blind_spot_px: list[float]


def somebody(draws: np.random.Generator, refresh_hz: float) -> Did:
    """Simulate the measurements of a person."""
    distance, pixel = draws.uniform(0.4, 0.8), draws.uniform(1e-4, 3e-4)
    edge, reaction = math.radians(draws.normal(12.5, 0.85)), max(draws.normal(0.3, 0.06), 0.15)
    presses = []
    for _ in range(REPETITIONS):
        away = distance * draws.normal(1, 0.02) * math.tan(edge) / pixel
        late = max(draws.normal(reaction, 0.05), 0.1) * STEP_PX * refresh_hz
        pressed = away + late if draws.random() > 0.03 else draws.uniform(0.15, 1) * away
        presses.append(STEP_PX * round(pressed / STEP_PX))
    return Did(distance, pixel, round((CARD[0] + draws.normal(0, 0.5e-3)) / pixel), presses)


def run(people: int, refresh_hz: float, seed: int) -> tuple[float, float, float, float, float]:
    """Return median error (%), fractions within one and two standard errors, mean SE (%), error of the plugin (%)."""
    draws = np.random.default_rng(seed)
    ours, errors, plugin = [], [], []
    for _ in range(people):
        did = somebody(draws, refresh_hz)
        found = measure(did.card_px, did.blind_spot_px, refresh_hz)
        assert found.distance_m is not None
        assert found.distance_sd_m is not None
        ours.append(found.distance_m / did.distance - 1)
        errors.append(found.distance_sd_m / did.distance)
        own = float(np.mean(did.blind_spot_px)) * CARD[0] / did.card_px / math.tan(math.radians(13.5))
        plugin.append(own / did.distance - 1)
    within = np.abs(ours) / np.array(errors)
    return (
        100 * float(np.median(ours)),
        float((within < 1).mean()),
        float((within < 2).mean()),
        100 * float(np.mean(errors)),
        100 * float(np.median(plugin)),
    )


def main() -> None:
    """Run, and print a line for each refresh rate."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--people", type=int, default=4000)
    people = parser.parse_args().people
    for hz in (60.0, 75.0, 120.0, 144.0):
        bias, one, two, error, plugin = run(people, hz, 1)
        print(
            f"{hz:g} Hz: median error {bias:+.1f} % (the plugin's {plugin:+.1f} %), standard error {error:.1f} %, "
            f"within one {100 * one:.0f} %, within two {100 * two:.0f} % of {people}"
        )


if __name__ == "__main__":
    main()
