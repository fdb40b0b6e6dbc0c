"""The command as a process: what it imports, keeps, prints and leaves behind."""

import os
import subprocess
import sys

import numpy as np
import pytest
from two_views import TOML

SETTINGS = ("views.toml", "--out", "out")
COMMAND = "import sys; from focalgradient.cli import main; main(sys.argv[1:])"


@pytest.mark.slow
def test_damaged_compiled_code_is_thrown_away(tmp_path):
    """Numba keeps compiled code in an index and files beside it, which a cut of the power can leave empty."""
    program = (
        "from focalgradient.cli import main\nfrom focalgradient.cli.doctor import doctor\n"
        "import numba\n@numba.njit(cache=True)\ndef f(x):\n    return x + 1\n"
        "doctor.callback = lambda **_: print(f(1))\nmain(['doctor'])\n"
    )
    (tmp_path / "program.py").write_text(program)
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "kept")}

    def run_program() -> subprocess.CompletedProcess[str]:
        command = [sys.executable, str(tmp_path / "program.py")]
        return subprocess.run(command, capture_output=True, text=True, env=environment, timeout=120)

    assert run_program().stdout == "2\n"
    (index,) = (tmp_path / "kept").rglob("*.nbi")
    index.write_bytes(index.read_bytes()[:20])
    damaged = run_program()
    assert (damaged.returncode, damaged.stdout, damaged.stderr.count("\n")) == (2, "", 1)
    assert damaged.stderr.startswith("Error: the cache of compiled code was damaged")
    assert run_program().stdout == "2\n"


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("views.toml", TOML.replace("b.png", "none.png").encode(), b"none.png cannot be read"),
        ("b.png", b"\x89PNG\r\n\x1a\nxxxx", b"b.png"),
    ],
)
def test_as_a_process_of_its_own(folder, name, content, said):
    """The image libraries write past Python on standard error: only a real process shows that nothing comes through."""
    (folder / name).write_bytes(content)
    command = [sys.executable, "-c", "from focalgradient.cli import main; main()", "depth", *SETTINGS]
    done = subprocess.run(command, capture_output=True, timeout=60)
    assert (done.returncode, done.stdout, done.stderr.count(b"\n")) == (2, b"", 1)
    assert said in done.stderr
    assert not (folder / "out").exists()


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="shells elsewhere close no streams")
def test_closed_standard_streams_are_not_missed(folder):
    """As by `2>&-`: results take the streams' numbers otherwise, and what libraries print goes into them."""
    close = "import os; [os.close(number) for number in (0, 1, 2)]\n"
    start = f"{close}import sys; sys.stdin = sys.stdout = sys.stderr = None\n{COMMAND}"
    done = subprocess.run([sys.executable, "-c", start, "depth", *SETTINGS], timeout=120)
    assert done.returncode == 0
    assert sorted(path.name for path in (folder / "out").iterdir()) == ["depth.npz", "depth.png", "summary.json"]
    assert np.load(folder / "out" / "depth.npz")["valid"].shape == (96, 96)
