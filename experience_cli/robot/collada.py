"""The points of a Collada mesh, as RViz and Gazebo place them."""

from collections.abc import Iterator
import math
from typing import Any, Final

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

#: So deep are nodes nested at most.
_DEEPEST: Final = 100


def vertices_from_collada(tree: Any) -> Floats:
    """
    Return the points of all geometries in the scene, shape (n, 3), [m].

    The unit of the file counts. Which axis is up does not: RViz and Gazebo pass that over.

    Raises
    ------
    ValueError
        If there are none, or it is no Collada.

    """
    for element in tree.iter():
        element.tag = str(element.tag).rpartition('}')[2]
    unit = tree.find('asset/unit')
    geometries = {mesh.get('id'): mesh for mesh in tree.iter('geometry')}
    found = [points for scene in tree.iter('visual_scene')
             for points in _of_node(scene, np.eye(4), geometries)]
    if not found:
        found = [_positions(mesh) for mesh in geometries.values()]
    if not found:
        raise ValueError('it holds no geometry')
    return np.concatenate(found) * float('1' if unit is None else unit.get('meter', '1'))


def _of_node(
    node: Any, place: Floats, geometries: dict[str, Any], depth: int = 0,
) -> Iterator[Floats]:
    if depth > _DEEPEST:
        raise ValueError('its nodes are nested too deeply')
    for element in node:
        place = place @ _motion(element)
    for instance in node.findall('instance_geometry'):
        mesh = geometries.get(instance.get('url', '').lstrip('#'))
        if mesh is not None:
            yield _positions(mesh) @ place[:3, :3].T + place[:3, 3]
    for child in node.findall('node'):
        yield from _of_node(child, place, geometries, depth + 1)


def _motion(element: Any) -> Floats:
    """Return the transform that an element of a node is, shape (4, 4); of others, none."""
    motion = np.eye(4)
    if element.tag not in ('matrix', 'translate', 'scale', 'rotate'):
        return motion
    values = _numbers(element)
    if element.tag == 'matrix':
        return values.reshape(4, 4)
    if element.tag == 'translate':
        motion[:3, 3] = values
    elif element.tag == 'scale':
        motion[:3, :3] = np.diag(values)
    else:
        axis, angle = values[:3] / np.linalg.norm(values[:3]), math.radians(values[3])
        across = np.cross(np.eye(3), axis)
        motion[:3, :3] = np.eye(3) - math.sin(angle) * across + (
            1.0 - math.cos(angle)) * across @ across
    return motion


def _positions(geometry: Any) -> Floats:
    """Return the points of a geometry, shape (n, 3)."""
    sources = {source.get('id'): source for source in geometry.iter('source')}
    found = [sources[each.get('source', '').lstrip('#')] for each in geometry.iter('input')
             if each.get('semantic') == 'POSITION'
             and each.get('source', '').lstrip('#') in sources]
    arrays = [source.find('float_array') for source in found]
    points = [_numbers(array) for array in arrays if array is not None]
    return np.concatenate(points).reshape(-1, 3) if points else np.empty((0, 3))


def _numbers(element: Any) -> Floats:
    return np.array((element.text or '').split(), dtype=np.float64)
