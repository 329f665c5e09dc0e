"""Meshes of a robot: where their files are, and which points they hold."""

import os
from pathlib import Path
import re
from typing import Final

import numpy as np
import numpy.typing as npt

from experience_cli.robot.collada import vertices_from_collada
from experience_cli.robot.xml_tree import tree_from_xml
from msgs_bridge.untrusted.files import read_bytes

#: The most that is read of a mesh, [bytes].
_MOST_BYTES: Final = 64 * 2**20
#: A triangle of a binary STL: its normal, its corners, two bytes more.
_FACET: Final = np.dtype([('normal', '<f4', 3), ('corners', '<f4', (3, 3)), ('more', '<u2')])
_HEADER: Final = 84
_NUMBER: Final = rb'[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?'
_VERTEX: Final = {'.stl': re.compile(rb'^\s*vertex\s+(%s)\s+(%s)\s+(%s)' % ((_NUMBER,) * 3), re.M),
                  '.obj': re.compile(rb'^\s*v\s+(%s)\s+(%s)\s+(%s)' % ((_NUMBER,) * 3), re.M)}


def mesh_file(name: str, urdf: Path, folders: list[Path]) -> Path:
    """
    Return the file of a mesh.

    Parameters
    ----------
    name : str
        ``package://PACKAGE/FILE``, ``model://``, ``file://`` or a path from the URDF's folder.
    urdf : Path
        The URDF: the package may lie around it.
    folders : list of Path
        Where packages are, beside those of `AMENT_PREFIX_PATH` and `ROS_PACKAGE_PATH`.

    Raises
    ------
    ValueError
        If it is not there.

    """
    scheme, _, rest = name.rpartition('://')
    if scheme in ('', 'file'):
        path = urdf.parent / rest
        if path.is_file():
            return path
        raise ValueError('there is no such file')
    package, _, inside = rest.partition('/')
    for folder in _packages(package, urdf, folders):
        if (folder / inside).is_file():
            return folder / inside
    raise ValueError(f'its file is not found (--packages FOLDER says where {package} is)')


def _packages(package: str, urdf: Path, folders: list[Path]) -> list[Path]:
    """Return the folders that a package may be."""
    found = [each / package for each in folders]
    found += [each for each in folders if each.name == package]
    for above in urdf.resolve().parents:
        found += [above] if above.name == package else [above / package]
    found += [Path(prefix) / 'share' / package
              for prefix in os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep) if prefix]
    return found + [Path(each) / package
                    for each in os.environ.get('ROS_PACKAGE_PATH', '').split(os.pathsep) if each]


def vertices_from_mesh(path: Path) -> npt.NDArray[np.float64]:
    """
    Return the points of an STL, OBJ or Collada file, shape (n, 3).

    Raises
    ------
    ValueError
        If it is another kind of file, or holds no points.
    OSError
        If it cannot be read.

    """
    kind = path.suffix.lower()
    if kind not in (*_VERTEX, '.dae'):
        raise ValueError(f'meshes of this kind ({kind or "no ending"}) are not read; STL, OBJ and '
                         f'DAE are')
    if kind == '.dae':
        return vertices_from_collada(tree_from_xml(read_bytes(path, _MOST_BYTES)))
    data = read_bytes(path, _MOST_BYTES)
    points = _from_binary_stl(data) if kind == '.stl' else None
    if points is None:
        points = np.array([list(map(float, each)) for each in _VERTEX[kind].findall(data)])
    if not len(points) or not np.isfinite(points).all():
        raise ValueError('it holds no points, or what are no numbers')
    return points


def _from_binary_stl(data: bytes) -> npt.NDArray[np.float64] | None:
    """Return the points of a binary STL; None if it is none, whatever its first word says."""
    n = int.from_bytes(data[_HEADER - 4:_HEADER], 'little')
    if len(data) != _HEADER + n * _FACET.itemsize:
        return None
    return np.frombuffer(data, _FACET, n, _HEADER)['corners'].reshape(-1, 3).astype(np.float64)
