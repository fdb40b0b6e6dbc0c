"""The number that the page writes beside the slider, as the page's own script makes it."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).parents[2] / "src" / "focalgradient" / "web" / "page" / "numbers.js"


def test_numbers_of_the_slider_have_three_digits_and_keep_the_zeros_of_whole_numbers() -> None:
    deno = shutil.which("deno", path=os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")]))
    assert deno, "deno is missing: it is among the packages for development"
    values = [0.25, 1.0, 1.5, 10.0, 100.0, 123.4, 1000.0]
    program = (
        f"import {{ significant }} from {json.dumps(SCRIPT.as_uri())};"
        f"console.log(JSON.stringify({json.dumps(values)}.map(significant)));"
    )
    done = subprocess.run([deno, "eval", "--no-config", program], capture_output=True, text=True, check=True)
    assert json.loads(done.stdout) == ["0.25", "1", "1.5", "10", "100", "123", "1000"]
