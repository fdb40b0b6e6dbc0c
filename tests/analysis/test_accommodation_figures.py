"""The figures of the eye in time: drawn from few data, and honest about what agrees."""

import accommodation_experiments as experiments


def test_agreement_follows_the_numbers():
    """A model that did just what was published would agree everywhere; one that responds to nothing would not."""
    published = {
        "gain": {"white": 0.8, "monochromatic": 0.4, "neutralised": 0.45, "reversed": 0.1},
        "focus": {"white": 2.0, "reversed": 0.2},
        "error": {"white": 0.3, "reversed": 2.0},
        "phase": {"white": -30.0, "monochromatic": -50.0},
        "pupil": {"0.5 mm": 0.2, "1 mm": 0.5, "3 mm": 0.9},
        "low-pass": {"1 c/deg": 0.0, "5.6 c/deg": 0.8, "sharp": 0.9},
        "empty": {"from 0.5 D": 1.4, "from 4 D": 1.6},
        "flicker": {"none": 1.0, "focus": 0.6, "contrast": 0.95},
        "rendered": {"real": 0.9, "defocus": 0.0, "chromatic": 0.8},
    }
    assert all(row.agrees(published[row.kind]) for row in experiments.ROWS)
    nothing = {kind: dict.fromkeys(values, 0.0) for kind, values in published.items()}
    assert sum(row.agrees(nothing[row.kind]) for row in experiments.ROWS) <= 1
    agreed = {cue: [True] * len(experiments.ROWS) for cue in experiments.CUES}
    assert experiments._draw(dict.fromkeys(experiments.CUES, published), agreed).axes
