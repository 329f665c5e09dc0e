"""What tests of commands share: bags that may be changed, and commands run in this process."""

import pytest

from experience_cli.main import main
from sample_helpers import sample_copy


@pytest.fixture
def task(tmp_path, monkeypatch):
    """Return a copy of the sample task, in ``bags`` of the working folder."""
    monkeypatch.chdir(tmp_path)
    return sample_copy(tmp_path)


@pytest.fixture
def experience(capsys):
    """Run a command that must do what it says; return its output."""
    def call(*words, code=0):
        assert main([str(word) for word in words]) == code
        return capsys.readouterr().out

    return call


@pytest.fixture
def mistake(capsys):
    """Run a command that the user got wrong; return the one line that says so."""
    def call(*words):
        assert main([str(word) for word in words]) == 2
        [line] = capsys.readouterr().err.splitlines()
        assert line.startswith(f'experience {words[0]}: ')
        return line

    return call
