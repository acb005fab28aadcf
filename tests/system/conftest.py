"""What the system tests share."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers import leeway


@pytest.fixture(scope="session")
def shelf(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of what the tests share."""
    return tmp_path_factory.mktemp("shelf")


@pytest.fixture
def short_log(root: Path, shelf: Path, private_network: None) -> Path:
    """Two seconds of a run, recorded by the first test that needs them."""
    log = shelf / "run.lcm"
    if not log.exists():
        result = leeway("run", root / "scenarios" / "c1.yaml", "--log", log, "--set=duration_s=2")
        assert result.returncode == 0, result.stderr
    return log
