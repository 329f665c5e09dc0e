"""Opening what is not ours: regular files only, none too large, no links out."""

import os
from pathlib import Path
import socket
import stat
import time

import pytest

from msgs_bridge.untrusted.files import (
    check_folder, check_held, draft_beside, is_draft, OddFileError, open_lock, open_regular,
    read_bytes, read_text, replace_file)


def make_pipe(path):
    os.mkfifo(path)


def make_socket(path):
    here = os.open('.', os.O_RDONLY)
    try:  # a socket's path is short
        os.chdir(path.parent)
        with socket.socket(socket.AF_UNIX) as server:
            server.bind(path.name)
    finally:
        os.fchdir(here)
        os.close(here)


def link_to(target):
    return lambda path: path.symlink_to(target)


ODD = {'pipe': make_pipe, 'socket': make_socket, 'folder': Path.mkdir,
       'endless': link_to('/dev/zero'), 'terminal': link_to('/dev/tty')}


@pytest.fixture(params=ODD)
def odd(request, tmp_path):
    path = tmp_path / 'metadata.yaml'
    ODD[request.param](path)
    return path


def test_what_is_no_regular_file_is_refused_at_once(odd):
    for call in (lambda: open_regular(odd), lambda: read_bytes(odd), lambda: open_lock(odd)):
        began = time.monotonic()
        with pytest.raises(OSError, match=r'metadata\.yaml') as caught:
            call()
        assert time.monotonic() - began < 1.0
        assert '\n' not in str(caught.value)


def test_a_regular_file_is_read_to_its_bound(tmp_path):
    path = tmp_path / 'file'
    path.write_bytes(b'ten bytes.')
    assert read_bytes(path, 10) == b'ten bytes.'
    assert read_text(path) == 'ten bytes.'
    with pytest.raises(OddFileError, match='it has 10 bytes'):
        read_bytes(path, 9)


def test_a_sparse_file_of_a_terabyte_is_refused_unread(tmp_path):
    path = tmp_path / 'file'
    with path.open('wb') as file:
        os.truncate(file.fileno(), 2**40)
    with pytest.raises(OddFileError, match='it has 1099511627776 bytes'):
        read_bytes(path)


def test_a_file_that_tells_no_size_is_bounded_too():
    with pytest.raises(OddFileError, match='at most 5'):
        read_bytes('/proc/self/status', 5)


def test_links_stay_within_the_folder_where_it_names_them(tmp_path):
    outside, folder = tmp_path / 'outside', tmp_path / 'bag'
    folder.mkdir()
    outside.write_bytes(b'secret')
    (folder / 'inside').write_bytes(b'ours')
    (folder / 'out').symlink_to(outside)
    (folder / 'in').symlink_to('inside')
    (folder / 'up').symlink_to(tmp_path)
    assert read_bytes(folder / 'out') == b'secret'  # a person typed it
    assert read_bytes(folder / 'in', within=folder) == b'ours'
    for name in ('out', 'up/outside', '../outside'):
        with pytest.raises(OddFileError, match='leads out of'):
            read_bytes(folder / name, within=folder)
        with pytest.raises(OddFileError, match='leads out of'):
            check_held(folder / name, folder)
    check_held(folder / 'in', folder)


def test_a_folder_may_itself_be_reached_by_a_link(tmp_path):
    (tmp_path / 'bag').mkdir()
    (tmp_path / 'bag' / 'file').write_bytes(b'ours')
    (tmp_path / 'link').symlink_to('bag')
    folder = tmp_path / 'link'
    assert read_bytes(folder / 'file', within=folder) == b'ours'


def test_a_link_with_the_name_of_what_is_written_is_not_followed(tmp_path):
    victim = tmp_path / 'victim'
    victim.write_bytes(b'mine')
    folder = tmp_path / 'bag'
    folder.mkdir()
    path = folder / 'metadata.yaml'
    for name in ('metadata.yaml', 'metadata.yaml.tmp', '.metadata.yaml.tmp'):
        (folder / name).symlink_to(victim)
    replace_file(path, b'ours')
    assert victim.read_bytes() == b'mine'
    assert path.read_bytes() == b'ours'
    assert not path.is_symlink()


def test_a_file_is_replaced_with_its_permissions_and_nothing_is_left(tmp_path):
    path = tmp_path / 'file'
    (tmp_path / 'other').touch()
    replace_file(path, b'one')
    assert path.stat().st_mode == (tmp_path / 'other').stat().st_mode
    (tmp_path / 'other').unlink()
    path.chmod(0o640)
    replace_file(path, b'two')
    assert (path.read_bytes(), stat.S_IMODE(path.stat().st_mode)) == (b'two', 0o640)
    assert [each.name for each in tmp_path.iterdir()] == ['file']


def test_a_draft_is_told_by_its_name_and_goes_again(tmp_path):
    with draft_beside(tmp_path / 'file') as first, draft_beside(tmp_path / 'file') as second:
        assert first != second
        assert is_draft(first.name)
        assert not first.exists()
        first.touch()
        second.touch()
        first.rename(tmp_path / 'file')
    assert [each.name for each in tmp_path.iterdir()] == ['file']
    assert not is_draft('file.tmp')


def test_a_lock_is_made_and_opened_but_not_through_a_link(tmp_path):
    os.close(open_lock(tmp_path / '.lock'))
    os.close(open_lock(tmp_path / '.lock', create=False))
    (tmp_path / 'link').symlink_to(tmp_path / 'victim')
    for create in (True, False):
        with pytest.raises(OddFileError, match='it is a link'):
            open_lock(tmp_path / 'link', create)
    assert not (tmp_path / 'victim').exists()
    with pytest.raises(FileNotFoundError):
        open_lock(tmp_path / 'none', create=False)


def test_a_folder_of_ours_is_no_link(tmp_path):
    check_folder(tmp_path / 'none')
    check_folder(tmp_path)
    (tmp_path / 'link').symlink_to(tmp_path)
    (tmp_path / 'file').touch()
    for name in ('link', 'file'):
        with pytest.raises(OddFileError):
            check_folder(tmp_path / name)
