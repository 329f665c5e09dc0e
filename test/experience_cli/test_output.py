"""Files that commands write."""

import os
from pathlib import Path
import resource
import threading

import pytest

from experience_cli.errors import UserError
from experience_cli.output import Output, write_output


def test_a_file_is_written_in_a_new_folder(tmp_path):
    path = tmp_path / 'new' / 'file'
    for content in (b'one', b'two'):
        write_output(path, lambda file, content=content: file.write(content))
        assert path.read_bytes() == content
    assert [each.name for each in path.parent.iterdir()] == ['file']


def test_what_was_there_stays_if_it_cannot_be_written(tmp_path):
    path = tmp_path / 'file'
    path.write_bytes(b'before')
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (3, before[1]))
    try:
        with pytest.raises(UserError, match='cannot write'):
            write_output(path, lambda file: file.write(b'after'))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert path.read_bytes() == b'before'
    assert [each.name for each in tmp_path.iterdir()] == ['file']


def test_a_link_that_waits_for_the_file_in_the_making_is_not_followed(tmp_path):
    (tmp_path / 'victim').write_bytes(b'mine')
    (tmp_path / 'file.part').symlink_to('victim')
    write_output(tmp_path / 'file', lambda file: file.write(b'ours'))
    assert (tmp_path / 'victim').read_bytes() == b'mine'


def test_a_full_disk_is_one_line():
    if not Path('/dev/full').exists():
        pytest.skip('there is no /dev/full here')
    with pytest.raises(UserError, match='cannot write /dev/full: No space left on device'):
        write_output(Path('/dev/full'), lambda file: file.write(b'anything'))


def test_a_pipe_that_nobody_reads_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / 'pipe')
    with pytest.raises(UserError, match='pipe: it is a pipe or socket that nobody reads'):
        write_output(tmp_path / 'pipe', lambda file: file.write(b'anything'))


def test_a_pipe_gets_the_content_once_somebody_reads_it(tmp_path):
    path = tmp_path / 'pipe'
    os.mkfifo(path)
    got = []
    reader = threading.Thread(target=lambda: got.append(path.read_bytes()))
    reader.start()
    write_output(path, lambda file: file.write(b'all of it'))
    reader.join()
    assert got == [b'all of it']
    assert path.is_fifo()


class TestBeforeLongWork:
    def test_a_reader_that_waits_gets_it_at_the_end(self, tmp_path):
        path, got = tmp_path / 'pipe', []
        os.mkfifo(path)
        reader = threading.Thread(target=lambda: got.append(path.read_bytes()))
        reader.start()
        output = Output(str(path), '--json')
        output.write(b'all of it')
        reader.join()
        assert got == [b'all of it']

    @pytest.mark.parametrize(('name', 'words'), [
        ('pipe', 'a pipe or socket that nobody reads'), ('folder', 'is a folder'),
        ('', 'is a folder'), ('none/report.json', 'there is no folder'),
        ('lost', 'there is no folder'), ('/proc/report.json', 'cannot be written'),
        ('/proc/self/comm', 'cannot be written'), ('x' * 300, 'name too long')])
    def test_what_cannot_be_written_is_refused(self, tmp_path, name, words, monkeypatch):
        monkeypatch.chdir(tmp_path)
        os.mkfifo('pipe')
        Path('folder').mkdir()
        Path('lost').symlink_to('none/report.json')
        with pytest.raises((UserError, OSError), match=words):
            Output(name, '--json')
        assert sorted(path.name for path in tmp_path.iterdir()) == ['folder', 'lost', 'pipe']

    def test_what_is_there_stays_until_it_is_written(self, tmp_path):
        path = tmp_path / 'report.json'
        path.write_bytes(b'before')
        output = Output(str(path), '--json')
        assert path.read_bytes() == b'before'
        output.write(b'after')
        assert path.read_bytes() == b'after'
        assert list(tmp_path.iterdir()) == [path]

    def test_a_link_stays_and_what_it_leads_to_is_written(self, tmp_path):
        (tmp_path / 'link').symlink_to('report.json')
        Output(str(tmp_path / 'link'), '--json').write(b'all of it')
        assert (tmp_path / 'report.json').read_bytes() == b'all of it'
        assert (tmp_path / 'link').is_symlink()
