"""How to cite focalgradient and the paper that it follows, in BibTeX."""

from __future__ import annotations

__all__ = ["bibtex"]

PAPER = """\
@article{pentland1987,
  author  = {Pentland, Alex Paul},
  title   = {A New Sense for Depth of Field},
  journal = {IEEE Transactions on Pattern Analysis and Machine Intelligence},
  volume  = {PAMI-9},
  number  = {4},
  pages   = {523--531},
  year    = {1987},
  doi     = {10.1109/TPAMI.1987.4767940},
}
"""


def bibtex(version: str) -> str:
    """Return BibTeX entries of the software, in this version, and of the paper.

    >>> bibtex("0.1.0").splitlines()[3]
    '  version = {0.1.0},'
    """
    return f"""\
@software{{focalgradient,
  author  = {{{{The focalgradient developers}}}},
  title   = {{focalgradient: depth from blur, for cameras, eyes and experiments}},
  version = {{{version}}},
  license = {{BSD-3-Clause}},
}}

{PAPER}"""
