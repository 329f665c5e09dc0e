"""
Which files make up an external bag, and what else lies beside them.

Nothing is skipped in silence: files that are not read are named, and a bag is refused where part
of the drive is certainly missing.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePath
import re
from typing import Any, Final

from control_field.words import counted
from episode_store.rosbag2.errors import BagError
from episode_store.rosbag2.mcap_scan import MAGIC
from episode_store.rosbag2.metadata import NAME
from msgs_bridge.untrusted.files import open_regular, read_text
from msgs_bridge.untrusted.yaml_texts import BoundlessYamlError, yaml_from_text

#: Endings of files that hold messages; of several copies the first in this order is read.
ENDINGS: Final = ('.mcap', '.db3', '.bag', '.bag.active', '.mcap.zstd', '.db3.zstd')
#: What SQLite keeps beside a file that it has not finished with; the last holds no messages.
WAL, JOURNAL, _SHARED_MEMORY = '-wal', '-journal', '-shm'
#: What programs append to the name of a file that they replaced or did not finish.
_LEFT_OVER: Final = re.compile(r'\.(mcap|db3|bag)(\.zstd)?[.~]', re.IGNORECASE)


@dataclass(frozen=True)
class Description:
    """
    What ``metadata.yaml`` says of a bag.

    Parameters
    ----------
    files : tuple of str
        Names of the files, in order.
    compression : str
        ``message``, ``file`` or empty.
    count : int or None
        Messages in all; None if it does not say.

    """

    files: tuple[str, ...] = ()
    compression: str = ''
    count: int | None = None


@dataclass(frozen=True)
class BagFiles:
    """
    The files of a bag.

    Parameters
    ----------
    paths : list of Path
        Those to be read, in order.
    description : Description or None
        Of the bag; None where ``metadata.yaml`` is missing or makes no sense.
    notes : list of str
        What was passed over, and what does not fit.

    """

    paths: list[Path]
    description: Description | None = None
    notes: list[str] = field(default_factory=list)

    @property
    def is_all(self) -> bool:
        """Return True if there are as many files as the description names."""
        return self.description is None or len(self.description.files) == len(self.paths)


def is_storage_file(path: Path) -> bool:
    """Return True if a file holds messages, judged by its name."""
    return path.name.endswith(ENDINGS)


def storage_files(folder: Path) -> list[Path]:
    """Return the files in a folder that hold messages, in the order of their numbers."""
    return sorted((path for path in folder.iterdir() if is_storage_file(path)), key=_by_number)


def read_description(folder: Path) -> Description | None:
    """
    Read a bag's ``metadata.yaml``; None if it is missing or says nothing of a bag.

    Raises
    ------
    BagError
        If it is no regular file, too large, or may stand for more than memory holds.

    """
    try:
        text = read_text(folder / NAME, within=folder, errors='replace')
    except FileNotFoundError:
        return None
    except OSError as error:
        raise BagError(f'cannot read {folder / NAME}: {error.strerror or error}') from None
    try:
        said = yaml_from_text(text)
    except BoundlessYamlError as error:
        raise BagError(f'cannot read {folder / NAME}: {error}') from None
    except ValueError:
        return None
    about = said.get('rosbag2_bagfile_information') if isinstance(said, dict) else None
    return _description(about) if isinstance(about, dict) else None


def _description(about: Mapping[str, Any]) -> Description:
    names, count = about.get('relative_file_paths'), about.get('message_count')
    return Description(
        tuple(PurePath(str(name)).name for name in names) if isinstance(names, list) else (),
        str(about.get('compression_mode') or '').strip().lower().replace('none', ''),
        count if isinstance(count, int) and 0 <= count < 2**63 else None)


def files_of_folder(folder: Path) -> BagFiles:
    """
    Find the files of a bag's folder.

    Raises
    ------
    BagError
        If there are none, one of them is missing, or what lies there does not fit together.

    """
    files = storage_files(folder)
    description = read_description(folder)
    if not files:
        raise BagError(f'cannot read {folder}: {_none_there(folder, description)}')
    _check_orphans(folder)
    if description is None or not description.files:
        chosen, notes = _without_copies(files)
        notes += filter(None, [_holes(chosen)])
    else:
        chosen, notes = _as_described(folder, description.files, files)
    left = [path.name for path in sorted(folder.iterdir())
            if _LEFT_OVER.search(path.name) and not is_storage_file(path)]
    notes += [f'{name} lies beside it and is not read' for name in left]
    return BagFiles(chosen, description, notes)


def files_of_file(path: Path) -> BagFiles:
    """Return a single file with its description; see `files_of_folder`."""
    description = read_description(path.parent)
    notes = []
    if description is not None and path.name in description.files[:1000]:
        others = [name for name in description.files if name != path.name]
        if others:
            notes.append(f'{path.name} is one of {len(others) + 1} files of its bag, the others '
                         f'are not read: name {path.parent} for all of them')
    return BagFiles([path], description, notes)


def differing_count(files: BagFiles, n_found: int | None) -> str:
    """Return a sentence if a bag does not hold the number of messages it should; else empty."""
    expected = files.description.count if files.description else None
    if expected is None or n_found is None or n_found == expected:
        return ''
    odd = f'{expected - n_found} are missing' if n_found < expected else 'more than it should be'
    return f'{NAME} counts {counted(expected, "message")}, {n_found} are there: {odd}'


def is_cut(path: Path) -> bool:
    """Return True if an MCAP file does not end like one that was closed."""
    if path.suffix != '.mcap' or not path.is_file():
        return False
    with open_regular(path) as file:
        file.seek(max(file.seek(0, 2) - len(MAGIC), 0))
        return file.read() != MAGIC


def _none_there(folder: Path, description: Description | None) -> str:
    """Return a sentence on a folder without a file that can be read."""
    said = 'there is no .mcap, .db3 or .bag file in it'
    named = ', '.join(description.files[:5]) if description else ''
    return f'{said}; {NAME} names {named}' if named else said


def _check_orphans(folder: Path) -> None:
    """Refuse what SQLite has left of a file that is called otherwise now: it may be the newest."""
    for path in sorted(folder.iterdir()):
        for ending in (WAL, JOURNAL):
            name = path.name.removesuffix(ending)
            if (name != path.name and name.endswith('.db3') and not (folder / name).exists()
                    and path.is_file() and path.stat().st_size):
                raise BagError(
                    f'cannot read {folder}: {path.name} holds messages of {name}, which is not '
                    f'there: give the .db3 file it belongs to that name, or remove {path.name}')


def _as_described(
    folder: Path, named: Sequence[str], files: Sequence[Path],
) -> tuple[list[Path], list[str]]:
    """Return the files that a description names, or those that stand for them."""
    there = {path.name: path for path in files}
    notes: list[str] = []
    stands: dict[str, Path] = {name: there[name] for name in named if name in there}
    for name in [name for name in named if name not in stands]:
        copy = there.get(f'{name}.zstd') or there.get(name.removesuffix('.zstd'))
        if copy is not None:
            stands[name] = copy
            notes.append(f'{NAME} names {name}, {copy.name} is read in its place')
    missing = [name for name in named if name not in stands]
    used = set(stands.values())
    others, copies = _without_copies(
        [path for path in files if path not in used],
        {_stem(path.name): path for path in used})
    notes += copies
    if missing and len(others) == len(missing):
        stands |= dict(zip(sorted(missing, key=_number_of), others, strict=True))
        notes += [f'{NAME} names {name}, which is not there; {stands[name].name} is read in its '
                  f'place' for name in missing]
        others = []
    elif missing and not stands:
        notes.append(f'{NAME} names {", ".join(missing[:5])}, none of which is there; '
                     f'{counted(len(others), "other file")} are read in their place')
        return others, notes
    elif missing:
        raise BagError(
            f'cannot read {folder}: {NAME} names {", ".join(missing[:5])}, which is not there, so '
            f'a part of the drive is missing; put it back, or name the files that are there')
    notes += [f'{path.name} is not named in {NAME} and not read: name it by itself'
              for path in others]
    return [stands[name] for name in dict.fromkeys(named)], notes


def _without_copies(
    files: Sequence[Path], held: Mapping[str, Path] | None = None,
) -> tuple[list[Path], list[str]]:
    """Leave out files that hold what another one holds: compressed, converted, or kept aside."""
    best: dict[str, Path] = dict(held or {})
    for path in sorted(files, key=_preference):
        best.setdefault(_stem(path.name), path)
    kept = [path for path in files if best[_stem(path.name)] == path]
    return kept, [f'{path.name} is taken for a copy of {best[_stem(path.name)].name} and not read'
                  for path in files if path not in kept]


def _holes(files: Sequence[Path]) -> str:
    """Return a sentence on missing numbers of a split bag's files; empty if none is missing."""
    found = [re.fullmatch(r'(.+_)(\d+)', _stem(path.name)) for path in files]
    numbers = sorted(int(match[2]) for match in found if match)
    if len(files) < 2 or len({match and match[1] for match in found}) > 1 or not numbers:
        return ''
    missing = sorted({*range(numbers[-1] + 1)} - {*numbers}) if numbers[-1] < 10**6 else []
    if not missing:
        return ''
    some = ', '.join(map(str, missing[:5])) + (', ...' if len(missing) > 5 else '')
    return (f'of the files {files[0].name} to {files[-1].name} those of number {some} are not '
            f'there: what was in them is missing')


def _preference(path: Path) -> tuple[bool, bool, int]:
    """Return a key that sorts the copy to be read before the others."""
    ending = _ending(path.name)
    return (path.name.removesuffix(ending).endswith('.orig'), is_cut(path),
            ENDINGS.index(ending))


def _ending(name: str) -> str:
    return max((ending for ending in ENDINGS if name.endswith(ending)), key=len, default='')


def _stem(name: str) -> str:
    return name.removesuffix(_ending(name)).removesuffix('.orig')


def _number_of(name: str) -> list[str | int]:
    """Return a key that sorts the tenth file behind the ninth."""
    return [int(part) if part.isdigit() else part for part in re.split(r'(\d+)', name)]


def _by_number(path: Path) -> list[str | int]:
    return _number_of(path.name)
