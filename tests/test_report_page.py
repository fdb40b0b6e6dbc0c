"""The page of a report in a browser, on a desk and on a phone."""

from pathlib import Path

import pytest
from browser import CHROMIUM, Browser
from recorded import record_necker, record_ratings

from focalgradient.power import Model
from focalgradient.report import make_report

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium")


@pytest.mark.slow
def test_nothing_of_a_report_is_cut(tmp_path: Path) -> None:
    """On a desk no table needs scrolling; on a phone wide tables and figures scroll in boxes of their own."""
    record_ratings(tmp_path / "data", 4, Model(effect=1.6))
    record_necker(tmp_path / "data", 4)
    page = tmp_path / "report.html"
    page.write_bytes(make_report(tmp_path / "data").files["report.html"])
    with Browser() as browser:
        for size, phone in (((1200, 900), False), ((390, 800), True)):
            browser.open(page, size, phone=phone)
            browser.wait("document.readyState === 'complete' && document.querySelector('h2')")
            assert browser.cut(scrolled=not phone) == []
