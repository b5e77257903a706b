"""The code of the README runs, and says what the README says."""

import re
from pathlib import Path

import pytest

PAGE = (Path(__file__).resolve().parents[1] / "README.md").read_text()
BLOCKS = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)


@pytest.mark.parametrize("number", range(len(BLOCKS)))
def test_the_code_runs(number, capsys):
    exec(compile(BLOCKS[number], f"README.md, block {number}", "exec"), {"__name__": "__main__"})
    said = capsys.readouterr().out
    for told in re.findall(r'print\(.*\) +# "(.*)"', BLOCKS[number]):
        assert told in said
    if "session" in BLOCKS[number]:
        assert "touched" in said and "released" in said
