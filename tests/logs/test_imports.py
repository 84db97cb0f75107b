"""Reading a plain text log loads no library that it does not use."""

import subprocess
import sys

HEAVY = ("scipy", "pandas", "polars", "pyarrow", "h5py", "narwhals", "pint", "pooch", "pydantic")

PROGRAM = """
import sys
from pathlib import Path
from stickslip.logs import read_log
path = Path(sys.argv[1], "stage.csv")
path.write_text("t [s],x [m],F [N]\\n0,1,2\\n1,2,3\\n")
read_log(path)
print(*(name for name in sys.argv[2:] if name in sys.modules))
"""


def test_heavy_libraries_stay_unloaded(tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(tmp_path), *HEAVY],
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.split() == []
